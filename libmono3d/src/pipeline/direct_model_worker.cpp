// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/direct_model_worker.h"

namespace mono3d {

void DirectModelWorker::Add(ImageBundle bundle, KeyframePosesPtr poses) {
  builder_.Add(EstimateDepth(*estimator_, std::move(bundle), *poses, DepthEffort::kFull), poses);
  builder_.PublishIfDue();
  TakeProgress();
}

void DirectModelWorker::Update(KeyframePosesPtr poses) {
  builder_.Update(poses);
  builder_.PublishIfDue();
  TakeProgress();
}

void DirectModelWorker::SaveState(StateFolder& folder, SavedImages /*images*/,
                                  const std::function<void()>& at_rest) {
  builder_.SaveState(folder);
  at_rest();
}

void DirectModelWorker::RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses,
                                     const ImageOfFrame& /*images*/) {
  builder_.RestoreState(folder, poses);
  TakeProgress();
}

// What was done before an error counts.
ModelBuilder& DirectModelWorker::End() {
  if (!has_ended_) TakeProgress();
  has_ended_ = true;
  return builder_;
}

void DirectModelWorker::TakeProgress() {
  ModelProgress progress = builder_.Progress();
  const std::lock_guard lock(mutex_);
  progress_ = std::move(progress);
}

ModelProgress DirectModelWorker::Progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

}  // namespace mono3d
