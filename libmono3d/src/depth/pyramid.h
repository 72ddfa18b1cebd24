// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/padded_image.h"
#include "gpu/recorder.h"

namespace mono3d {

// Halves `num_images` grey images (shaders/depth/pyramid.comp). `fine` and `coarse` hold padded
// images one after the other, of `size` and `size.Halved()`.
class PyramidStage {
 public:
  explicit PyramidStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const Buffer& fine, LevelSize size, std::uint32_t num_images,
              const Buffer& coarse) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
