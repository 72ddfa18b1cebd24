// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "pipeline/model_worker.h"

namespace mono3d {

// Builds the models in a thread of its own, so that nobody waits for it. One bundle waits at most:
// a newer one takes its place, which is then dropped and counted (paper, section 3.1). Of the
// keyframes' poses the latest ones wait; the models follow them before the bundle that waits is
// worked at.
class ModelThread final : public ModelWorker {
 public:
  // What the work throws is handed to `on_error` as well, in this thread; it may be empty.
  explicit ModelThread(ModelStages stages, std::function<void(std::exception_ptr)> on_error = {});
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
  ModelBuilder& End() override;

 private:
  void Run();
  bool WaitForWork(std::unique_lock<std::mutex>& lock);
  void Work(std::optional<ImageBundle> bundle, const KeyframePosesPtr& poses);
  void Rethrow();

  ModelBuilder builder_;  // the thread's own while it runs
  std::function<void(std::exception_ptr)> on_error_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  KeyframePosesPtr poses_;             // waits, where not null
  std::optional<ImageBundle> bundle_;  // waits, with poses_
  ModelProgress progress_;             // without the dropped bundles
  ModelFeedback feedback_;
  std::int64_t num_dropped_ = 0;
  bool is_busy_ = false;
  bool is_ending_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace mono3d
