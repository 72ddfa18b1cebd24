// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>

#include "mono3d/image/frame_images.h"
#include "mono3d/image/image_bundle.h"
#include "mono3d/image/keyframe_poses.h"
#include "pipeline/model_builder.h"

namespace mono3d {

// Has the models built, by the calling thread or by another one. Called by one thread at a time,
// but for Progress and Published, which any thread may call at any time.
// Add, Update and Wait throw what the work has thrown, once; after that nothing more is done.
class ModelWorker {
 public:
  virtual ~ModelWorker() = default;

  virtual void Add(ImageBundle bundle, KeyframePosesPtr poses) = 0;
  virtual void Update(KeyframePosesPtr poses) = 0;
  // Until nothing waits or is worked at.
  virtual void Wait() = 0;
  // Until one more bundle can be added without one being dropped or made with less effort.
  virtual void WaitForRoom() = 0;

  // As ModelBuilder has it, of the work that is done.
  virtual ModelFeedback TakeFeedback() = 0;
  // As of the latest work done.
  virtual ModelProgress Progress() const = 0;
  // As ModelPublisher::Latest.
  virtual PublishedModel Published(std::uint64_t since_version) = 0;

  // As ModelBuilder, with the bundles that are not done. `at_rest` is called while no models are
  // worked at. Throws UsageError on that of a live run.
  virtual void SaveState(StateFolder& folder, SavedImages images,
                         const std::function<void()>& at_rest) = 0;
  // `poses`: the latest ones that the worker that was saved had been given.
  virtual void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses,
                            const ImageOfFrame& images) = 0;

  // Ends after the work in hand; what waits is left undone. The builder is the caller's from then
  // on, as long as the worker lives. May be called again.
  virtual ModelBuilder& End() = 0;
};

}  // namespace mono3d
