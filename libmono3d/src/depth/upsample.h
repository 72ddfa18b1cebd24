// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/upsample.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// Inverse depth and confidence of a coarse level at full resolution (shaders/depth/upsample.comp).
class UpsampleStage {
 public:
  explicit UpsampleStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const UpsampleParams& params, const Buffer& coarse_depth,
              const Buffer& coarse_confidence, const Buffer& inverse_depth,
              const Buffer& confidence) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
