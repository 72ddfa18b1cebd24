// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <memory>

#include "depth/plane_sweep.params.h"
#include "depth/source_kernels.h"
#include "gpu/recorder.h"

namespace mono3d {

// Matching costs of all planes (shaders/depth/plane_sweep.comp). `census` holds the reference and
// then the images of the sources; `projections` those, packed; `costs` gets params.padded_planes
// bytes for each pixel.
class PlaneSweepStage {
 public:
  // `side_tolerance`: PlaneSweepOptions::side_tolerance.
  explicit PlaneSweepStage(std::shared_ptr<Device> device, std::uint32_t side_tolerance);

  void Record(Recorder& recorder, std::size_t num_sources, const PlaneSweepParams& params,
              const Buffer& census, const Buffer& projections, const Buffer& costs);

 private:
  SourceKernels kernels_;
};

}  // namespace mono3d
