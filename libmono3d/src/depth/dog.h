// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/padded_image.h"
#include "gpu/recorder.h"

namespace mono3d {

// Difference of Gaussians of the first padded image in `image` (shaders/depth/dog.comp). `response`
// gets a word for each of size.num_strided_pixels() pixels.
class DogStage {
 public:
  explicit DogStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const Buffer& image, LevelSize size,
              const Buffer& response) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
