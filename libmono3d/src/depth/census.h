// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/padded_image.h"
#include "gpu/recorder.h"

namespace mono3d {

// Census transform, 9x7, of `num_images` padded images (shaders/depth/census.comp). `census` gets
// two words for each of size.num_strided_pixels() pixels of each image.
class CensusStage {
 public:
  explicit CensusStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const Buffer& images, LevelSize size, std::uint32_t num_images,
              const Buffer& census) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
