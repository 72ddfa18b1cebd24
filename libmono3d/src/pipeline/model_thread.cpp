// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_thread.h"

#include <utility>

namespace mono3d {

ModelThread::ModelThread(ModelBuilder& builder) : builder_(builder) {
  thread_ = std::thread([this] { Run(); });
}

ModelThread::~ModelThread() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ModelThread::Add(ImageBundle bundle) {
  {
    const std::lock_guard lock(mutex_);
    Rethrow();
    num_dropped_ += bundle_ ? 1 : 0;
    bundle_ = std::move(bundle);
  }
  changed_.notify_all();
}

void ModelThread::Change(MapChange change) {
  if (change.joined.empty() && change.corrections.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    Rethrow();
    if (bundle_) MoveBundle(change.corrections, scales_, *bundle_);
    scales_.Take(change.corrections);
    changes_.push_back(std::move(change));
  }
  changed_.notify_all();
}

void ModelThread::Wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return error_ != nullptr || is_ending_ || (!HasWork() && !is_busy_); });
  Rethrow();
}

void ModelThread::Rethrow() {
  if (error_ != nullptr) std::rethrow_exception(std::exchange(error_, nullptr));
}

ModelFeedback ModelThread::TakeFeedback() {
  const std::lock_guard lock(mutex_);
  return std::exchange(feedback_, {});
}

std::int64_t ModelThread::num_dropped() const {
  const std::lock_guard lock(mutex_);
  return num_dropped_;
}

ModelProgress ModelThread::Progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

void ModelThread::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || HasWork(); });
    if (is_ending_) return;
    is_busy_ = true;
    const std::vector<MapChange> changes = std::exchange(changes_, {});
    const std::optional<ImageBundle> bundle = std::exchange(bundle_, std::nullopt);
    lock.unlock();
    std::exception_ptr error;
    ModelProgress progress;
    ModelFeedback feedback;
    try {
      for (const MapChange& change : changes) builder_.Change(change);
      if (bundle) builder_.Add(*bundle);
      progress = builder_.Progress();
      feedback = builder_.TakeFeedback();
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (error == nullptr) {
      progress_ = std::move(progress);
      feedback_.Append(feedback);
    }
    is_busy_ = false;
    error_ = error;
    is_ending_ = is_ending_ || error != nullptr;
    changed_.notify_all();
  }
}

}  // namespace mono3d
