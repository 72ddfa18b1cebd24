// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "pipeline/model_worker.h"

namespace mono3d {

// The calling thread builds the models, before each call returns.
class DirectModelWorker final : public ModelWorker {
 public:
  DirectModelWorker(std::unique_ptr<DepthEstimator> estimator, ModelStages stages)
      : estimator_(std::move(estimator)), builder_(std::move(stages)) {}

  void Add(ImageBundle bundle, KeyframePosesPtr poses) override;
  void Update(KeyframePosesPtr poses) override;
  void Wait() override {}
  void WaitForRoom() override {}
  ModelFeedback TakeFeedback() override { return builder_.TakeFeedback(); }
  ModelProgress Progress() const override;
  PublishedModel Published(std::uint64_t since_version) override {
    return builder_.publisher().Latest(since_version);
  }
  void SaveState(StateFolder& folder, SavedImages images,
                 const std::function<void()>& at_rest) override;
  void RestoreState(const StateFolder& folder, const KeyframePosesPtr& poses,
                    const ImageOfFrame& images) override;
  ModelBuilder& End() override;

 private:
  void TakeProgress();

  std::unique_ptr<DepthEstimator> estimator_;
  ModelBuilder builder_;
  mutable std::mutex mutex_;
  ModelProgress progress_;
  bool has_ended_ = false;
};

}  // namespace mono3d
