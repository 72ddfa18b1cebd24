// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/plane_sweep.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// Matching costs of all planes (shaders/depth/plane_sweep.comp). `census` holds the reference and
// then the images of the four sources, two before and two after it; `projections` 48 floats;
// `costs` gets params.padded_planes bytes for each pixel.
class PlaneSweepStage {
 public:
  explicit PlaneSweepStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const PlaneSweepParams& params, const Buffer& census,
              const Buffer& projections, const Buffer& costs) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
