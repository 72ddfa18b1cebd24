// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_thread.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/thread_priority.h"
#include "pipeline/clock.h"

namespace mono3d {

ModelThread::ModelThread(std::unique_ptr<DepthEstimator> estimator, ModelStages stages,
                         std::size_t max_waiting, std::function<void(std::exception_ptr)> on_error)
    : builder_(std::move(stages)),
      on_error_(std::move(on_error)),
      max_waiting_(max_waiting),
      depth_(std::move(estimator), ThreadPriority::kTenth) {
  thread_ = std::thread([this] {
    LowerThreadPriority(ThreadPriority::kTenth);
    Run();
  });
}

void ModelThread::SaveState(StateFolder& /*folder*/, SavedImages /*images*/,
                            const std::function<void()>& /*at_rest*/) {
  throw UsageError("the state of a live run cannot be saved");
}

void ModelThread::RestoreState(const StateFolder& /*folder*/, const KeyframePosesPtr& /*poses*/,
                               const ImageOfFrame& /*images*/) {
  throw UsageError("a live run cannot be restored");
}

ModelThread::~ModelThread() { static_cast<void>(End()); }

ModelBuilder& ModelThread::End() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (!thread_.joinable()) return builder_;
  thread_.join();
  const std::lock_guard lock(mutex_);
  progress_ = builder_.Progress();  // what was done before an error counts
  return builder_;
}

void ModelThread::Add(ImageBundle bundle, KeyframePosesPtr poses) {
  {
    const std::lock_guard lock(mutex_);
    Rethrow();
    governor_.NoteArrival(Clock_s());
    if (bundles_.size() == max_waiting_) {
      ++num_dropped_;
      bundles_.pop_front();
    }
    bundles_.push_back(std::move(bundle));
    poses_ = std::move(poses);
    have_poses_changed_ = true;
    TakeNextBundle();
  }
  changed_.notify_all();
}

void ModelThread::Update(KeyframePosesPtr poses) {
  {
    const std::lock_guard lock(mutex_);
    Rethrow();
    poses_ = std::move(poses);
    have_poses_changed_ = true;
  }
  changed_.notify_all();
}

void ModelThread::Wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return error_ || is_ending_ || (!HasWork() && !is_busy_); });
  Rethrow();
}

void ModelThread::WaitForRoom() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return error_ || is_ending_ || bundles_.empty(); });
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
  ModelProgress progress = progress_;
  progress.counts.num_dropped_bundles = num_dropped_;
  return progress;
}

PublishedModel ModelThread::Published(std::uint64_t since_version) {
  PublishedModel published;
  {
    const std::lock_guard lock(mutex_);
    published = builder_.publisher().Latest(since_version);
  }
  changed_.notify_all();  // now that somebody is interested
  return published;
}

// False when the thread is to end.
bool ModelThread::WaitForWork(std::unique_lock<std::mutex>& lock) {
  while (!is_ending_ && !HasWork()) {
    const std::optional<double> due_s = builder_.publisher().Due_s();
    const double wait_s = due_s ? *due_s - Clock_s() : 0;
    if (!due_s) {
      changed_.wait(lock);
    } else if (wait_s > 0) {
      changed_.wait_for(lock, std::chrono::duration<double>(wait_s));
    } else {
      break;
    }
  }
  return !is_ending_;
}

// To the depth thread, once it has none.
void ModelThread::TakeNextBundle() {
  if (in_hand_ || bundles_.empty()) return;
  in_hand_ = {depth_.Estimate(std::move(bundles_.front()), poses_, governor_.effort()), Clock_s()};
  bundles_.pop_front();
}

void ModelThread::Work(std::optional<EstimatedBundle> bundle, const KeyframePosesPtr& poses) {
  if (bundle) {
    builder_.Add(*bundle, poses);
  } else if (poses) {
    builder_.Update(poses);
  }
  builder_.PublishIfDue();
}

void ModelThread::Run() {
  std::unique_lock lock(mutex_);
  while (WaitForWork(lock)) {
    is_busy_ = true;
    const bool has_bundle = in_hand_.has_value();
    double begin_s = 0;
    std::exception_ptr error;
    ModelProgress progress;
    ModelFeedback feedback;
    try {
      std::optional<EstimatedBundle> bundle;
      if (has_bundle) {
        // Of this thread alone while it waits: nobody takes what is in hand.
        std::future<EstimatedBundle>& estimated = in_hand_->estimated;
        lock.unlock();
        estimated.wait();
        lock.lock();
        begin_s = std::max(in_hand_->begin_s, last_end_s_);
        bundle = std::exchange(in_hand_, std::nullopt)->estimated.get();
        TakeNextBundle();
        changed_.notify_all();
      }
      have_poses_changed_ = false;
      const KeyframePosesPtr poses = poses_;
      lock.unlock();
      Work(std::move(bundle), poses);
      progress = builder_.Progress();
      feedback = builder_.TakeFeedback();
    } catch (...) {
      error = std::current_exception();
      if (lock.owns_lock()) lock.unlock();
      if (on_error_) on_error_(error);
    }
    lock.lock();
    if (!error) {
      progress_ = std::move(progress);
      feedback_.Append(feedback);
      last_end_s_ = Clock_s();
      if (has_bundle) governor_.NoteWork(last_end_s_ - begin_s, bundles_.size(), max_waiting_);
    }
    is_busy_ = false;
    is_ending_ = is_ending_ || error;
    error_ = std::move(error);  // who takes it has it alone
    changed_.notify_all();
  }
}

}  // namespace mono3d
