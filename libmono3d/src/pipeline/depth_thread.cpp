// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/depth_thread.h"

#include <utility>

namespace mono3d {

EstimatedBundle EstimateDepth(DepthEstimator& estimator, ImageBundle bundle,
                              const KeyframePoses& poses, DepthEffort effort) {
  EstimatedBundle estimated{std::move(bundle), effort, std::nullopt};
  if (!SetPoses(poses, estimated.bundle)) return estimated;
  estimator.SetEffort(effort);
  estimated.depth = estimator.Estimate(estimated.bundle);
  return estimated;
}

DepthThread::DepthThread(std::unique_ptr<DepthEstimator> estimator,
                         std::optional<ThreadPriority> priority)
    : estimator_(std::move(estimator)) {
  thread_ = std::thread([this, priority] {
    if (priority) LowerThreadPriority(*priority);
    Run();
  });
}

DepthThread::~DepthThread() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::future<EstimatedBundle> DepthThread::Estimate(ImageBundle bundle, KeyframePosesPtr poses,
                                                   DepthEffort effort) {
  std::packaged_task<EstimatedBundle()> task(
      [this, bundle = std::move(bundle), poses = std::move(poses), effort]() mutable {
        return EstimateDepth(*estimator_, std::move(bundle), *poses, effort);
      });
  std::future<EstimatedBundle> estimated = task.get_future();
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(task));
  }
  changed_.notify_all();
  return estimated;
}

void DepthThread::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || !waiting_.empty(); });
    if (is_ending_) return;
    std::packaged_task<EstimatedBundle()> task = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

}  // namespace mono3d
