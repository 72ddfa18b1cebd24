// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/detail.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// High-pass grey images in words for bilinear interpolation (shaders/depth/detail.comp),
// `num_images` from params.first_image on. `quarter` holds the padded images halved twice; `detail`
// gets a word for each strided pixel.
class DetailStage {
 public:
  explicit DetailStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const DetailParams& params, std::uint32_t num_images,
              const Buffer& images, const Buffer& quarter, const Buffer& detail) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
