// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "pipeline/model_worker.h"

namespace mono3d {

// A thread of its own builds the models while the next frames are tracked, everything in the order
// in which it came. Add waits until the bundle before is done, and only Add and Wait let out what
// the work has come to (feedback, progress, what it threw): so it reaches the caller at the same
// frame, however fast the thread was, and the same input gives the same result.
class TrailingModelWorker final : public ModelWorker {
 public:
  explicit TrailingModelWorker(ModelStages stages);
  ~TrailingModelWorker() override;

  void Add(ImageBundle bundle, KeyframePosesPtr poses) override;
  void Update(KeyframePosesPtr poses) override;
  void Wait() override;
  ModelFeedback TakeFeedback() override;
  ModelProgress Progress() const override;
  PublishedModel Published(std::uint64_t since_version) override {
    return builder_.publisher().Latest(since_version);
  }
  void SaveState(StateFolder& folder) override;
  void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses) override;
  ModelBuilder& End() override;

 private:
  struct Work {
    std::optional<ImageBundle> bundle;  // none: only the poses have changed
    KeyframePosesPtr poses;
  };

  void Run();
  void Do(Work work);
  void WaitUntilIdle(std::unique_lock<std::mutex>& lock);
  void Release();

  ModelBuilder builder_;  // of the thread; of the caller while nothing waits and is worked at
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Work> waiting_;
  bool is_busy_ = false;
  bool is_ending_ = false;
  std::exception_ptr error_;  // nothing is done any more
  ModelFeedback released_;
  ModelProgress progress_;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace mono3d
