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

#include "common/write_thread.h"
#include "mono3d/core/timing.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/write_failures.h"

namespace mono3d::tools {

// Depth maps and keyframe images of a run that may begin again with another camera: those of the
// runs before are removed when it is adopted. Any thread. Those that cannot be written are
// failures, and the run goes on.
class AdoptedFiles {
 public:
  AdoptedFiles(const RunWriter& writer, WriteFailures& failures, StageTimes& times)
      : context_{writer, failures, times} {}

 private:
  struct Context {
    const RunWriter& writer;
    WriteFailures& failures;
    StageTimes& times;
  };

 public:
  // Of one camera; write through it.
  class Run {
   public:
    explicit Run(const Context& context) : context_(context) {}
    // In a thread of the run.
    void WriteDepthMap(const DepthMap& map);
    void WriteKeyframeImage(const Frame& frame);
    // Until all depth maps are written.
    void Wait() const { thread_.Wait(); }

    // For the journal of a run, and back; see common/state_json.h. What is listed is on the disk:
    // waits for it.
    nlohmann::json ToJson() const;
    void TakeJson(const nlohmann::json& json);
    // Those up to that frame that the run has not written by then: it was broken off, and made what
    // it could of its last images.
    void RemoveOtherDepthMaps(std::int64_t last_frame) const;

   private:
    friend class AdoptedFiles;
    void Write(const DepthMap& map);

    Context context_;
    mutable std::mutex mutex_;
    std::optional<CameraModel> depth_camera_;
    std::set<std::int64_t> depth_maps_;      // by frame
    std::set<std::string> keyframe_images_;  // by name of the frame
    WriteThread thread_;                     // uses the rest
  };

  std::shared_ptr<Run> BeginRun();
  // The latest run was adopted: removes what only the one before it has written. Nobody writes
  // through that any more.
  void RemoveBefore();

  // Until all depth maps of the latest run are written.
  void Wait() const {
    if (latest_) latest_->Wait();
  }
  // Of the depth maps that are there; nothing where there are none.
  std::optional<CameraModel> DepthCamera() const;

 private:
  Context context_;
  std::shared_ptr<Run> before_;
  std::shared_ptr<Run> latest_;
};

}  // namespace mono3d::tools
