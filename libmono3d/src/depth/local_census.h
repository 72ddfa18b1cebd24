// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <memory>

#include "depth/padded_image.h"
#include "gpu/recorder.h"

namespace mono3d {

// Texels of four words of an image, as shaders/depth/local_census.glsl says.
inline std::size_t NumLocalCensusTexels(LevelSize size) {
  return std::size_t{2} * size.groups_per_row() * size.height_px + 1;
}

// Census transforms for the planes around a prior (shaders/depth/local_census.comp), of
// `num_images` padded images; `census` gets NumLocalCensusTexels of each.
class LocalCensusStage {
 public:
  explicit LocalCensusStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const Buffer& images, LevelSize size, std::uint32_t num_images,
              const Buffer& census) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
