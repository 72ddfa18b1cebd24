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
constexpr std::uint32_t kFeedbackStateVersion = 2;
constexpr const char* kFeedbackPart = "feedback";

}  // namespace

TrailingModelWorker::TrailingModelWorker(std::unique_ptr<DepthEstimator> estimator,
                                         ModelStages stages)
    : builder_(std::move(stages)), depth_(std::move(estimator)) {
  thread_ = std::thread([this] { Run(); });
}

TrailingModelWorker::~TrailingModelWorker() { static_cast<void>(End()); }

void TrailingModelWorker::Add(ImageBundle bundle, KeyframePosesPtr poses) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return is_ending_ || num_undone_ <= 1; });
    // An error of the bundle before waits for the next call: so it comes at the same frame, too.
    if (num_undone_ > 1) Rethrow();
    Release(num_undone_ == 0 ? 1 : 0);
    ++num_undone_;
    std::future<EstimatedBundle> estimated = depth_.Estimate(std::move(bundle), poses);
    waiting_.push_back({std::move(estimated), std::move(poses)});
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
  Release(0);
  progress_ = builder_.Progress();
}

void TrailingModelWorker::WaitUntilIdle(std::unique_lock<std::mutex>& lock) {
  changed_.wait(lock, [&] { return is_ending_ || (waiting_.empty() && !is_busy_); });
  Rethrow();
}

// What the work has thrown, once.
void TrailingModelWorker::Rethrow() {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

// All but so many of the latest.
void TrailingModelWorker::Release(std::size_t num_kept) {
  while (outcomes_.size() > num_kept) {
    released_.Append(outcomes_.front().feedback);
    progress_ = std::move(outcomes_.front().progress);
    outcomes_.erase(outcomes_.begin());
  }
}

ModelFeedback TrailingModelWorker::TakeFeedback() {
  const std::lock_guard lock(mutex_);
  return std::exchange(released_, {});
}

ModelProgress TrailingModelWorker::Progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

template <typename Archive>
void TrailingModelWorker::ExchangeFeedback(Archive& archive) {
  using mono3d::ExchangeState;
  ExchangeState(archive, released_);
  archive.List(outcomes_, [&](Outcome& outcome) { ExchangeState(archive, outcome.feedback); });
}

// What is not let out yet is saved as such, so that a run that goes on does what others do.
void TrailingModelWorker::SaveState(StateFolder& folder) {
  std::unique_lock lock(mutex_);
  WaitUntilIdle(lock);
  builder_.SaveState(folder);
  StateWriter writer(kFeedbackState, kFeedbackStateVersion, SavedImages::kByIndex);
  ExchangeFeedback(writer);
  PutSections(folder, kFeedbackPart, writer.TakeState());
}

void TrailingModelWorker::RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses) {
  std::unique_lock lock(mutex_);
  WaitUntilIdle(lock);
  builder_.RestoreState(folder, poses);
  const std::string state = GetSections(folder, kFeedbackPart);
  StateReader reader(state, kFeedbackState, kFeedbackStateVersion, folder.path().string(), {});
  ExchangeFeedback(reader);
  reader.CheckEnd();
  progress_ = builder_.Progress();
  for (Outcome& outcome : outcomes_) outcome.progress = progress_;
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
    builder_.Add(work.bundle->get(), work.poses);
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
    const bool has_bundle = work.bundle.has_value();
    lock.unlock();
    std::exception_ptr error;
    Outcome outcome;
    try {
      Do(std::move(work));
      if (has_bundle) outcome = {builder_.TakeFeedback(), builder_.Progress()};
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    is_busy_ = false;
    if (has_bundle && !error) {
      --num_undone_;
      outcomes_.push_back(std::move(outcome));
    }
    is_ending_ = is_ending_ || error;
    error_ = std::move(error);
    changed_.notify_all();
  }
}

}  // namespace mono3d
