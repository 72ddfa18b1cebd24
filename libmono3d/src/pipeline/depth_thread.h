// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "mono3d/core/thread_priority.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/image/image_bundle.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// A bundle with the poses of the moment, and what the depth stage made of it.
struct EstimatedBundle {
  ImageBundle bundle;
  DepthEffort effort = DepthEffort::kFull;
  std::optional<DepthResult> depth;  // none: its keyframes were not of one map
};

// The depth map of a bundle with these poses.
EstimatedBundle EstimateDepth(DepthEstimator& estimator, ImageBundle bundle,
                              const KeyframePoses& poses, DepthEffort effort);

// Estimates depth maps in a thread of its own, one after the other in the order in which they are
// asked for, so that the next one is made while the one before is fused: the host's part of one
// stage fills the time in which the device works for the other.
class DepthThread {
 public:
  explicit DepthThread(std::unique_ptr<DepthEstimator> estimator,
                       std::optional<ThreadPriority> priority = std::nullopt);
  // After the one in hand. What waits is left undone; its futures throw std::future_error.
  ~DepthThread();
  DepthThread(const DepthThread&) = delete;
  DepthThread& operator=(const DepthThread&) = delete;

  // Returns at once. The future throws what the estimator has thrown.
  std::future<EstimatedBundle> Estimate(ImageBundle bundle, KeyframePosesPtr poses,
                                        DepthEffort effort = DepthEffort::kFull);

 private:
  void Run();

  std::unique_ptr<DepthEstimator> estimator_;  // of the thread
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::packaged_task<EstimatedBundle()>> waiting_;
  bool is_ending_ = false;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace mono3d
