// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/prior.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// The planes that each pixel of a level is matched on, from the depth and normals of the next
// coarser level (shaders/depth/prior.comp). `image` begins with the padded reference of the level;
// `ranges` gets two words for each of
// NumLocalPixels.
class PriorStage {
 public:
  explicit PriorStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const PriorParams& params, const Buffer& coarse_depth,
              const Buffer& coarse_normal, const Buffer& image, const Buffer& ranges) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
