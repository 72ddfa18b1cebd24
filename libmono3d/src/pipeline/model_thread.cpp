// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_thread.h"

#include <utility>

namespace mono3d {

ModelThread::ModelThread(ModelStages stages) : builder_(std::move(stages)) {
  thread_ = std::thread([this] { Run(); });
}

ModelThread::~ModelThread() { static_cast<void>(End()); }

ModelBuilder& ModelThread::End() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  return builder_;
}

void ModelThread::Add(ImageBundle bundle, KeyframePosesPtr poses) {
  {
    const std::lock_guard lock(mutex_);
    Rethrow();
    num_dropped_ += bundle_ ? 1 : 0;
    bundle_ = std::move(bundle);
    poses_ = std::move(poses);
  }
  changed_.notify_all();
}

void ModelThread::Update(KeyframePosesPtr poses) {
  {
    const std::lock_guard lock(mutex_);
    Rethrow();
    poses_ = std::move(poses);
  }
  changed_.notify_all();
}

void ModelThread::Wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return error_ || is_ending_ || (!poses_ && !is_busy_); });
  Rethrow();
}

void ModelThread::Rethrow() {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

ModelFeedback ModelThread::TakeFeedback() {
  const std::lock_guard lock(mutex_);
  return std::exchange(feedback_, {});
}

ModelProgress ModelThread::Progress() const {
  const std::lock_guard lock(mutex_);
  ModelProgress progress = thread_.joinable() ? progress_ : builder_.Progress();
  progress.counts.num_dropped_bundles = num_dropped_;
  return progress;
}

void ModelThread::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || poses_; });
    if (is_ending_) return;
    is_busy_ = true;
    const KeyframePosesPtr poses = std::exchange(poses_, nullptr);
    std::optional<ImageBundle> bundle = std::exchange(bundle_, std::nullopt);
    lock.unlock();
    std::exception_ptr error;
    ModelProgress progress;
    ModelFeedback feedback;
    try {
      if (bundle) {
        builder_.Add(*std::move(bundle), poses);
      } else {
        builder_.Update(poses);
      }
      progress = builder_.Progress();
      feedback = builder_.TakeFeedback();
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (!error) {
      progress_ = std::move(progress);
      feedback_.Append(feedback);
    }
    is_busy_ = false;
    error_ = error;
    is_ending_ = is_ending_ || error;
    changed_.notify_all();
  }
}

}  // namespace mono3d
