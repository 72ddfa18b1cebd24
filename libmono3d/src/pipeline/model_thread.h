// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "pipeline/keyframe_scales.h"
#include "pipeline/model_builder.h"

namespace mono3d {

// Builds the model in a thread of its own, so that nobody waits for it. One bundle waits at most:
// a newer one takes its place, which is then dropped and counted (paper, section 3.1). Changes of
// the map are never dropped, and come before the bundle that waits, which moves with them; the
// bundle that is being worked at was begun before them and is fused before them.
class ModelThread {
 public:
  explicit ModelThread(ModelBuilder& builder);
  // Ends after the work in hand; what waits is left undone.
  ~ModelThread();
  ModelThread(const ModelThread&) = delete;
  ModelThread& operator=(const ModelThread&) = delete;

  // All throw what the work has thrown, once; from then on nothing more is done.
  void Add(ImageBundle bundle);
  void Change(MapChange change);
  // Until nothing waits or is worked at.
  void Wait();

  // As ModelBuilder has it, of the work that is done.
  ModelFeedback TakeFeedback();

  std::int64_t num_dropped() const;
  ModelProgress Progress() const;  // as of the latest work done

 private:
  void Run();
  bool HasWork() const { return !changes_.empty() || bundle_.has_value(); }
  void Rethrow();

  ModelBuilder& builder_;  // the thread's own while it works
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<MapChange> changes_;
  std::optional<ImageBundle> bundle_;
  KeyframeScales scales_;  // after the changes
  ModelProgress progress_;
  ModelFeedback feedback_;
  std::int64_t num_dropped_ = 0;
  bool is_busy_ = false;
  bool is_ending_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace mono3d
