// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/padded_image.h"
#include "gpu/recorder.h"

namespace mono3d {

// The first of `num_images` images as it is, then of each other four: itself, half a pixel to the
// right, below, and both (shaders/depth/half_pixel.comp). Buffers hold padded images of `size`.
class HalfPixelStage {
 public:
  explicit HalfPixelStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const Buffer& images, LevelSize size, std::uint32_t num_images,
              const Buffer& shifted) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
