// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "pipeline/depth_governor.h"
#include "pipeline/model_worker.h"

namespace mono3d {

// Builds the models in a thread of its own, of low priority, so that nobody waits for it. So many
// bundles wait at most; a newer one takes the place of the oldest, which is then dropped and
// counted (paper, section 3.1). Before that, depth maps take less work (DepthGovernor). Of the
// keyframes' poses the latest ones wait; the models follow them before the next bundle is worked
// at.
class ModelThread final : public ModelWorker {
 public:
  // What the work throws is handed to `on_error` as well, in this thread; it may be empty.
  ModelThread(ModelStages stages, std::size_t max_waiting,
              std::function<void(std::exception_ptr)> on_error = {});
  // Ends after the work in hand; what waits is left undone.
  ~ModelThread() override;
  ModelThread(const ModelThread&) = delete;
  ModelThread& operator=(const ModelThread&) = delete;

  void Add(ImageBundle bundle, KeyframePosesPtr poses) override;
  void Update(KeyframePosesPtr poses) override;
  void Wait() override;
  ModelFeedback TakeFeedback() override;
  ModelProgress Progress() const override;
  PublishedModel Published(std::uint64_t since_version) override;
  void SaveState(StateFolder& folder) override;
  void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses) override;
  ModelBuilder& End() override;

 private:
  void Run();
  bool HasWork() const { return have_poses_changed_ || !bundles_.empty(); }
  bool WaitForWork(std::unique_lock<std::mutex>& lock);
  void Work(std::optional<ImageBundle> bundle, const KeyframePosesPtr& poses, DepthEffort effort);
  void Rethrow();

  ModelBuilder builder_;  // the thread's own while it runs
  std::function<void(std::exception_ptr)> on_error_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  KeyframePosesPtr poses_;           // the latest
  bool have_poses_changed_ = false;  // the models have not followed them yet
  std::size_t max_waiting_;
  std::deque<ImageBundle> bundles_;  // that wait, oldest first
  DepthGovernor governor_;
  ModelProgress progress_;  // without the dropped bundles
  ModelFeedback feedback_;
  std::int64_t num_dropped_ = 0;
  bool is_busy_ = false;
  bool is_ending_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace mono3d
