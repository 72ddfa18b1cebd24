// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <memory>

#include "depth/local_sweep.params.h"
#include "depth/source_kernels.h"
#include "gpu/recorder.h"

namespace mono3d {

// Matching costs of the planes around the prior (shaders/depth/local_sweep.comp). `census` is
// local_census.h's of the reference and then the sources; `costs` gets kLocalPlanes bytes for each
// of NumLocalPixels.
class LocalSweepStage {
 public:
  // `side_tolerance`: PlaneSweepOptions::side_tolerance.
  explicit LocalSweepStage(std::shared_ptr<Device> device, std::uint32_t side_tolerance);

  void Record(Recorder& recorder, std::size_t num_sources, const LocalSweepParams& params,
              const Buffer& census, const Buffer& projections, const Buffer& ranges,
              const Buffer& costs);

 private:
  SourceKernels kernels_;
};

}  // namespace mono3d
