// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "depth/measurement.h"
#include "depth/photometric.params.h"
#include "depth/source_kernels.h"
#include "gpu/recorder.h"

namespace mono3d {

// Detail (detail.comp) of the reference, of the sources before it and of those after it: of all in
// one buffer there would be too much to bind at 3840x2160.
struct DetailBuffers {
  const Buffer& reference;
  const Buffer& before;
  const Buffer& after;
};

// A step of inverse depth on grey values (shaders/depth/photometric.comp). `measurements` gets two
// words for each of NumMeasurements.
class PhotometricStage {
 public:
  explicit PhotometricStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, std::size_t num_sources, const PhotometricParams& params,
              const DetailBuffers& detail, const Buffer& projections, const Buffer& inverse_depth,
              const Buffer& measurements);

 private:
  SourceKernels kernels_;
};

}  // namespace mono3d
