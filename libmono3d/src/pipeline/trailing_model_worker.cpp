// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/trailing_model_worker.h"

#include <string>
#include <utility>

#include "pipeline/run_state.h"
#include "pipeline/state_parts.h"

namespace mono3d {
namespace {

constexpr const char* kFeedbackState = "feedback of the model";
constexpr std::uint32_t kFeedbackStateVersion = 1;
constexpr const char* kFeedbackPart = "feedback";

}  // namespace

TrailingModelWorker::TrailingModelWorker(ModelStages stages) : builder_(std::move(stages)) {
  thread_ = std::thread([this] { Run(); });
}

TrailingModelWorker::~TrailingModelWorker() { static_cast<void>(End()); }

void TrailingModelWorker::Add(ImageBundle bundle, KeyframePosesPtr poses) {
  {
    std::unique_lock lock(mutex_);
    WaitUntilIdle(lock);
    Release();
    waiting_.push_back({std::move(bundle), std::move(poses)});
  }
  changed_.notify_all();
}

void TrailingModelWorker::Update(KeyframePosesPtr poses) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({std::nullopt, std::move(poses)});
  }
  changed_.notify_all();
}

void TrailingModelWorker::Wait() {
  std::unique_lock lock(mutex_);
  WaitUntilIdle(lock);
  Release();
}

// Throws what the work has thrown, once.
void TrailingModelWorker::WaitUntilIdle(std::unique_lock<std::mutex>& lock) {
  changed_.wait(lock, [&] { return error_ || is_ending_ || (waiting_.empty() && !is_busy_); });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void TrailingModelWorker::Release() {
  released_.Append(builder_.TakeFeedback());
  progress_ = builder_.Progress();
}

ModelFeedback TrailingModelWorker::TakeFeedback() {
  const std::lock_guard lock(mutex_);
  return std::exchange(released_, {});
}

ModelProgress TrailingModelWorker::Progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

// What is not let out yet stays in the builder, so that a run that is saved does what others do.
void TrailingModelWorker::SaveState(StateFolder& folder) {
  std::unique_lock lock(mutex_);
  WaitUntilIdle(lock);
  builder_.SaveState(folder);
  StateWriter writer(kFeedbackState, kFeedbackStateVersion, SavedImages::kByIndex);
  ExchangeState(writer, released_);
  PutSections(folder, kFeedbackPart, writer.TakeState());
}

void TrailingModelWorker::RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses) {
  std::unique_lock lock(mutex_);
  WaitUntilIdle(lock);
  builder_.RestoreState(folder, poses);
  const std::string state = GetSections(folder, kFeedbackPart);
  StateReader reader(state, kFeedbackState, kFeedbackStateVersion, folder.path().string(), {});
  ExchangeState(reader, released_);
  reader.CheckEnd();
  progress_ = builder_.Progress();
}

// What was done before an error counts.
ModelBuilder& TrailingModelWorker::End() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (!thread_.joinable()) return builder_;
  thread_.join();
  const std::lock_guard lock(mutex_);
  progress_ = builder_.Progress();
  return builder_;
}

void TrailingModelWorker::Do(Work work) {
  if (work.bundle) {
    builder_.Add(*std::move(work.bundle), work.poses);
  } else {
    builder_.Update(work.poses);
  }
  builder_.PublishIfDue();
}

void TrailingModelWorker::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || !waiting_.empty(); });
    if (is_ending_) return;
    Work work = std::move(waiting_.front());
    waiting_.pop_front();
    is_busy_ = true;
    lock.unlock();
    std::exception_ptr error;
    try {
      Do(std::move(work));
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    is_busy_ = false;
    is_ending_ = is_ending_ || error;
    error_ = std::move(error);
    changed_.notify_all();
  }
}

}  // namespace mono3d
