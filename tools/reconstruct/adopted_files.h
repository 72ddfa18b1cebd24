// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "mono3d/pipeline/run_writer.h"

namespace mono3d::tools {

// Depth maps and keyframe images of a run that may begin again with another camera: those of the
// runs before are removed when it is adopted. Any thread.
class AdoptedFiles {
 public:
  explicit AdoptedFiles(const RunWriter& writer) : writer_(writer) {}

  // Of one camera; write through it.
  class Run {
   public:
    explicit Run(const RunWriter& writer) : writer_(writer) {}
    void WriteDepthMap(const DepthMap& map);
    void WriteKeyframeImage(const Frame& frame);

    // For the journal of a run, and back; see common/state_json.h. What is listed is on the disk.
    nlohmann::json ToJson() const;
    void TakeJson(const nlohmann::json& json);
    // Those up to that frame that the run has not written by then: it was broken off, and made what
    // it could of its last images.
    void RemoveOtherDepthMaps(std::int64_t last_frame) const;

   private:
    friend class AdoptedFiles;
    const RunWriter& writer_;
    mutable std::mutex mutex_;
    std::optional<CameraModel> depth_camera_;
    std::set<std::int64_t> depth_maps_;      // by frame
    std::set<std::string> keyframe_images_;  // by name of the frame
  };

  std::shared_ptr<Run> BeginRun();
  // The latest run was adopted: removes what only the one before it has written. Nobody writes
  // through that any more.
  void RemoveBefore();

  // Of the depth maps that are there; nothing where there are none.
  std::optional<CameraModel> DepthCamera() const;

 private:
  const RunWriter& writer_;
  std::shared_ptr<Run> before_;
  std::shared_ptr<Run> latest_;
};

}  // namespace mono3d::tools
