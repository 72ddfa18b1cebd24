// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/median.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// 5x5 median of inverse depth with its support (shaders/depth/median.comp). Buffers hold
// size.num_pixels() floats.
class MedianStage {
 public:
  // Without confidence that of all pixels is 0.
  explicit MedianStage(std::shared_ptr<Device> device, bool with_confidence = true);

  void Record(Recorder& recorder, const MedianParams& params, const Buffer& inverse_depth,
              const Buffer& confidence, const Buffer& median_depth,
              const Buffer& median_confidence) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
