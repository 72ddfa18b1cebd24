// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "view/view_store.h"

namespace mono3d::tools {

// The folder of a run, as mono3d-reconstruct writes it; only model.ply must be there.
class RunFolder {
 public:
  // Throws Error where there is no such folder.
  explicit RunFolder(const std::filesystem::path& folder);

  std::filesystem::path model_path() const { return folder_ / "model.ply"; }

  // Way, keyframes, camera and what run.json tells.
  void Show(ViewStore& store, std::int64_t num_surfels,
            std::span<const Eigen::Vector3f> normals) const;

  // JPEG of a keyframe by its number in the list of keyframes, "image" or "depth"; null where the
  // run, or the input that it names, has none. Thread-safe, one at a time.
  SharedBytes Picture(const std::string& kind, std::int64_t keyframe) const;

 private:
  struct Keyframe {
    std::filesystem::path image;    // may not be there
    std::int64_t frame_index = -1;  // names the files of depth/; -1: not known
    Pose T_world_cam;
  };
  void ReadKeyframes();
  nlohmann::json Status(std::int64_t num_surfels) const;
  nlohmann::json PlaceOnEarth() const;  // null where it is not known
  bool IsOfPhotos() const;
  // Where up is, as far as run.json tells of the axes.
  std::optional<Eigen::Vector3d> KnownUp() const;

  std::filesystem::path folder_;
  nlohmann::json record_;  // run.json
  std::vector<Keyframe> keyframes_;
  CameraModel camera_;
  mutable std::mutex mutex_;
};

}  // namespace mono3d::tools
