// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "view/surfel_block.h"

namespace mono3d::tools {

// In front of surfels on their way to the page.
inline constexpr std::size_t kBytesOfSurfelsHead = 48;

using SharedBytes = std::shared_ptr<const std::string>;

// tx ty tz qx qy qz qw, in single precision, which is enough for a page
nlohmann::json PoseNumbers(const Pose& pose);

// A camera on the way; `id` names the pictures of a keyframe.
struct ViewPose {
  std::int64_t id = 0;
  double timestamp_s = 0;
  Pose T_world_cam;
};

struct FrameTime {
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
};

// Where the camera should fly next.
struct ViewProposal {
  Pose T_world_cam;
  Eigen::Vector3d target_world = Eigen::Vector3d::Zero();
  std::string reason;
  double gain_share = 0;  // of the model's surface
};

// What viewers see, with a version of everything: each viewer asks for what has changed since the
// version that it has, and fetches at its own pace. Nothing is kept of a viewer, so that neither
// their number nor their pace costs memory. Thread-safe; no call waits for more than copies.
class ViewStore {
 public:
  ViewStore();

  // --- What is shown ---
  // The blocks of the model are `ids`, in no order; `changed` are new or differ from before.
  void SetModel(const std::vector<std::int64_t>& ids, std::vector<SurfelBlock> changed);
  void SetTransforms(const std::map<std::int64_t, Similarity>& S_world_block);
  void SetKeyframes(std::vector<ViewPose> keyframes);
  void SetPath(std::vector<ViewPose> path);  // every frame, where they are known
  void SetCamera(const CameraModel& camera);
  void SetUp(const Eigen::Vector3d& up);
  void SetNextViews(const std::vector<ViewProposal>& next_views);
  void SetTimes(const FrameTime& first, const FrameTime& last);  // of the model's frames
  void SetErrors(double largest_m);       // how far off are surfels with an error of 1, or further
  void SetStatus(nlohmann::json status);  // what the page says in words and numbers
  // JPEG. The latest ones are "image" and "depth"; those of a keyframe are kept beside, the newest
  // up to some megabytes.
  void SetPicture(const std::string& kind, SharedBytes jpeg);
  void SetPictureOfKeyframe(const std::string& kind, std::int64_t keyframe_id, SharedBytes jpeg);

  // --- For viewers ---
  // What has changed since a version, as JSON; from 0: everything.
  std::string Changes(std::uint64_t since) const;
  // Surfels `first` to `first + count` of a block as it is now, behind what the page must know of
  // it: double version, float low[3], high[3], max_radius, uint32 number of surfels in all, uint32
  // first and last of its frames (1 and 0: not known). Nothing where there is no such block. A
  // block of a live run may have changed since the viewer heard of it: it gets what there is, and
  // not a refusal again and again.
  std::optional<std::string> Surfels(std::int64_t id, std::uint64_t first,
                                     std::uint64_t count) const;
  SharedBytes Picture(const std::string& kind) const;  // null: none
  SharedBytes PictureOfKeyframe(const std::string& kind, std::int64_t keyframe_id) const;

  // Seconds since a viewer has asked for changes.
  double SecondsSinceAsked() const;
  static constexpr double kNeverAsked_s = 1e9;

 private:
  struct Entry {
    SurfelBlock block;
    std::uint64_t version = 0;            // of the surfels
    std::uint64_t transform_version = 0;  // of where they are
  };
  struct Versioned {
    nlohmann::json value;
    std::uint64_t version = 0;
  };
  void Set(const std::string& name, nlohmann::json value);

  mutable std::mutex mutex_;
  std::uint64_t server_ =
      0;  // differs from run to run: a page that goes on asking then starts anew
  std::uint64_t version_ = 1;
  std::uint64_t ids_version_ = 0;
  std::map<std::int64_t, Entry> blocks_;
  std::map<std::string, Versioned> values_;
  std::map<std::string, SharedBytes> pictures_;
  std::map<std::pair<std::int64_t, std::string>, SharedBytes> keyframe_pictures_;
  std::size_t keyframe_picture_bytes_ = 0;
  mutable std::optional<double> asked_at_ms_;
};

}  // namespace mono3d::tools
