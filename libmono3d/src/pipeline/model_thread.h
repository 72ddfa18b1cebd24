// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "pipeline/depth_governor.h"
#include "pipeline/depth_thread.h"
#include "pipeline/model_worker.h"

namespace mono3d {

// Builds the models in two threads of its own, of low priority, so that nobody waits for them: one
// estimates the next depth map while the other one fuses the one before. So many bundles wait at
// most; a newer one takes the place of the oldest, which is then dropped and counted (paper,
// section 3.1). Before that, depth maps take less work (DepthGovernor). Of the keyframes' poses the
// latest ones wait; the models follow them before the next depth map is fused.
class ModelThread final : public ModelWorker {
 public:
  // What the work throws is handed to `on_error` as well, in this thread; it may be empty.
  ModelThread(std::unique_ptr<DepthEstimator> estimator, ModelStages stages,
              std::size_t max_waiting, std::function<void(std::exception_ptr)> on_error = {});
  // Ends after the work in hand; what waits is left undone.
  ~ModelThread() override;
  ModelThread(const ModelThread&) = delete;
  ModelThread& operator=(const ModelThread&) = delete;

  void Add(ImageBundle bundle, KeyframePosesPtr poses) override;
  void Update(KeyframePosesPtr poses) override;
  void Wait() override;
  void WaitForRoom() override;
  ModelFeedback TakeFeedback() override;
  ModelProgress Progress() const override;
  PublishedModel Published(std::uint64_t since_version) override;
  void SaveState(StateFolder& folder, SavedImages images,
                 const std::function<void()>& at_rest) override;
  void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses,
                    const ImageOfFrame& images) override;
  ModelBuilder& End() override;

 private:
  // A bundle in the hands of the depth thread.
  struct InHand {
    std::future<EstimatedBundle> estimated;
    double begin_s = 0;
  };

  void Run();
  bool HasWork() const { return have_poses_changed_ || in_hand_.has_value(); }
  bool WaitForWork(std::unique_lock<std::mutex>& lock);
  void TakeNextBundle();
  void Work(std::optional<EstimatedBundle> bundle, const KeyframePosesPtr& poses);
  void Rethrow();

  ModelBuilder builder_;  // the thread's own while it runs
  std::function<void(std::exception_ptr)> on_error_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  KeyframePosesPtr poses_;           // the latest
  bool have_poses_changed_ = false;  // the models have not followed them yet
  std::size_t max_waiting_;
  std::deque<ImageBundle> bundles_;  // that wait, oldest first
  std::optional<InHand> in_hand_;    // none only where none waits
  double last_end_s_ = 0;            // of the work at a bundle
  DepthGovernor governor_;
  ModelProgress progress_;  // without the dropped bundles
  ModelFeedback feedback_;
  std::int64_t num_dropped_ = 0;
  bool is_busy_ = false;
  bool is_ending_ = false;
  std::exception_ptr error_;
  DepthThread depth_;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace mono3d
