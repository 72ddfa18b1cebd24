// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/trailing_model_worker.h"

#include <mutex>
#include <string>
#include <utility>

#include "pipeline/run_state.h"
#include "pipeline/state_parts.h"

namespace mono3d {
namespace {

constexpr const char* kFeedbackState = "feedback of the model";
constexpr std::uint32_t kFeedbackStateVersion = 3;
constexpr const char* kFeedbackPart = "feedback";

}  // namespace

class TrailingModelWorker::Hold {
 public:
  // Throws what the work has thrown.
  explicit Hold(TrailingModelWorker& worker) : worker_(worker) {
    std::unique_lock lock(worker.mutex_);
    worker.is_held_ = true;  // first: else the next work might be begun meanwhile
    worker.changed_.wait(lock, [&] { return worker.is_ending_ || !worker.is_busy_; });
    if (worker.error_) worker.is_held_ = false;
    worker.Rethrow();
  }
  ~Hold() {
    {
      const std::lock_guard lock(worker_.mutex_);
      worker_.is_held_ = false;
    }
    worker_.changed_.notify_all();
  }
  Hold(const Hold&) = delete;
  Hold& operator=(const Hold&) = delete;

 private:
  TrailingModelWorker& worker_;
};

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
    Push(std::move(bundle), std::move(poses));
  }
  changed_.notify_all();
}

void TrailingModelWorker::Push(std::optional<ImageBundle> bundle, KeyframePosesPtr poses) {
  Work work{std::move(bundle), std::move(poses), {}};
  if (work.bundle) {
    ++num_undone_;
    work.estimated = depth_.Estimate(*work.bundle, work.poses);
  }
  waiting_.push_back(std::move(work));
}

void TrailingModelWorker::Update(KeyframePosesPtr poses) {
  {
    const std::lock_guard lock(mutex_);
    Push(std::nullopt, std::move(poses));
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
void TrailingModelWorker::ExchangeState(Archive& archive, std::vector<KeyframePosesPtr>& snapshots,
                                        std::vector<SavedWork>& waiting) {
  using mono3d::ExchangeState;
  ExchangeState(archive, released_);
  archive.List(outcomes_, [&](Outcome& outcome) { ExchangeState(archive, outcome.feedback); });
  archive.List(snapshots, [&](KeyframePosesPtr& poses) {
    if (!poses) poses = std::make_shared<KeyframePoses>();
    ExchangeState(archive, poses);
  });
  archive.List(waiting, [&](SavedWork& work) {
    archive.Index(work.snapshot);
    bool has_bundle = work.bundle.has_value();
    archive.Number(has_bundle);
    if (!has_bundle) return;
    if constexpr (Archive::kReads) work.bundle.emplace();
    ExchangeState(archive, *work.bundle);
  });
}

// What is not done or not let out yet is saved as such, so that a run that goes on does what others
// do.
void TrailingModelWorker::SaveState(StateFolder& folder, SavedImages images,
                                    const std::function<void()>& at_rest) {
  const Hold hold(*this);
  builder_.SaveState(folder);
  std::vector<KeyframePosesPtr> snapshots = {builder_.poses()};
  std::vector<SavedWork> waiting;
  for (const Work& work : waiting_) {
    if (work.poses != snapshots.back()) snapshots.push_back(work.poses);
    waiting.push_back({work.bundle, snapshots.size() - 1});
  }
  StateWriter writer(kFeedbackState, kFeedbackStateVersion, images);
  ExchangeState(writer, snapshots, waiting);
  PutSections(folder, kFeedbackPart, writer.TakeState());
  at_rest();
}

std::vector<std::int64_t> TrailingModelWorker::FramesOfState(const StateFolder& folder) {
  if (folder.Names(kFeedbackPart).empty()) return {};
  return mono3d::FramesOfState(GetSections(folder, kFeedbackPart), folder.path().string());
}

void TrailingModelWorker::RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses,
                                       const ImageOfFrame& images) {
  const Hold hold(*this);
  const std::string state = GetSections(folder, kFeedbackPart);
  StateReader reader(state, kFeedbackState, kFeedbackStateVersion, folder.path().string(), images);
  std::vector<KeyframePosesPtr> snapshots;
  std::vector<SavedWork> waiting;
  ExchangeState(reader, snapshots, waiting);
  reader.CheckEnd();
  if (snapshots.empty()) reader.Refuse("has no poses");
  // The same object where it is the same snapshot: else the models would follow it once more.
  for (KeyframePosesPtr& snapshot : snapshots) {
    if (snapshot->version() == poses->version()) snapshot = poses;
  }
  builder_.RestoreState(folder, snapshots.front());
  progress_ = builder_.Progress();
  for (Outcome& outcome : outcomes_) outcome.progress = progress_;
  const std::lock_guard lock(mutex_);
  for (SavedWork& work : waiting) {
    if (work.snapshot >= snapshots.size()) reader.Refuse("contradicts itself");
    Push(std::move(work.bundle), snapshots[work.snapshot]);
  }
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
    builder_.Add(work.estimated.get(), work.poses);
  } else {
    builder_.Update(work.poses);
  }
  builder_.PublishIfDue();
}

// Until there is work that can be done; false when the thread is to end.
bool TrailingModelWorker::WaitForWork(std::unique_lock<std::mutex>& lock) {
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || (!is_held_ && !waiting_.empty()); });
    if (is_ending_) return false;
    const std::future<EstimatedBundle>& estimated = waiting_.front().estimated;
    if (!estimated.valid()) return true;
    lock.unlock();
    estimated.wait();  // of this thread alone: nobody else takes what waits
    lock.lock();
    if (!is_ending_ && !is_held_) return true;
  }
}

void TrailingModelWorker::Run() {
  std::unique_lock lock(mutex_);
  while (WaitForWork(lock)) {
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
