// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <utility>

#include "pipeline/model_worker.h"

namespace mono3d {

// The calling thread builds the models, before each call returns.
class DirectModelWorker final : public ModelWorker {
 public:
  explicit DirectModelWorker(ModelStages stages) : builder_(std::move(stages)) {}

  void Add(ImageBundle bundle, KeyframePosesPtr poses) override;
  void Update(KeyframePosesPtr poses) override;
  void Wait() override {}
  ModelFeedback TakeFeedback() override { return builder_.TakeFeedback(); }
  ModelProgress Progress() const override { return builder_.Progress(); }
  ModelBuilder& End() override { return builder_; }

 private:
  ModelBuilder builder_;
};

}  // namespace mono3d
