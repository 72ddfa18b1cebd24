// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "pipeline/depth_thread.h"
#include "pipeline/model_worker.h"

namespace mono3d {

// Threads of their own build the models while the next frames are tracked, everything in the order
// in which it came: one estimates depth maps, the other one fuses the one before. Add waits until
// at most one bundle is not done, and only Add and Wait let out what the work has come to
// (feedback, progress, what it threw), Add that of all bundles but the one before: so it reaches
// the caller at the same frame, however fast the threads were, and the same input gives the same
// result.
class TrailingModelWorker final : public ModelWorker {
 public:
  TrailingModelWorker(std::unique_ptr<DepthEstimator> estimator, ModelStages stages);
  ~TrailingModelWorker() override;

  void Add(ImageBundle bundle, KeyframePosesPtr poses) override;
  void Update(KeyframePosesPtr poses) override;
  void Wait() override;
  void WaitForRoom() override {}  // Add does
  ModelFeedback TakeFeedback() override;
  ModelProgress Progress() const override;
  PublishedModel Published(std::uint64_t since_version) override {
    return builder_.publisher().Latest(since_version);
  }
  // The models are held between two bundles for it, not until all are done.
  void SaveState(StateFolder& folder, SavedImages images,
                 const std::function<void()>& at_rest) override;
  // The frames whose images RestoreState will ask for; none where it was another worker's state.
  static std::vector<std::int64_t> FramesOfState(const StateFolder& folder);
  void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses,
                    const ImageOfFrame& images) override;
  ModelBuilder& End() override;

 private:
  struct Work {
    std::optional<ImageBundle> bundle;  // none: only the poses have changed
    KeyframePosesPtr poses;
    std::future<EstimatedBundle> estimated;  // of the bundle
  };
  struct SavedWork {
    std::optional<ImageBundle> bundle;
    std::size_t snapshot = 0;  // its poses
  };
  // What a bundle has come to, and what came before it.
  struct Outcome {
    ModelFeedback feedback;
    ModelProgress progress;
  };

  // While it lives, no work is begun or in hand.
  class Hold;

  void Run();
  bool WaitForWork(std::unique_lock<std::mutex>& lock);
  void Push(std::optional<ImageBundle> bundle, KeyframePosesPtr poses);
  void Do(Work work);
  void WaitUntilIdle(std::unique_lock<std::mutex>& lock);
  void Rethrow();
  void Release(std::size_t num_kept);
  template <typename Archive>
  void ExchangeState(Archive& archive, std::vector<KeyframePosesPtr>& snapshots,
                     std::vector<SavedWork>& waiting);

  ModelBuilder builder_;  // of the thread; of the caller while it is held
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Work> waiting_;
  bool is_busy_ = false;
  bool is_held_ = false;
  bool is_ending_ = false;
  std::exception_ptr error_;       // nothing is done any more
  std::size_t num_undone_ = 0;     // bundles
  std::vector<Outcome> outcomes_;  // of bundles that are done, not let out yet; two at most
  ModelFeedback released_;
  ModelProgress progress_;
  DepthThread depth_;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace mono3d
