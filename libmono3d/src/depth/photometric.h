// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "depth/padded_image.h"
#include "depth/photometric.params.h"
#include "depth/source_kernels.h"
#include "gpu/recorder.h"

namespace mono3d {

// Of zeros around the measurements: the radius of the window of SurfaceStage.
inline constexpr std::uint32_t kMeasurementBorder = 3;

// In rows from the top, with the border.
inline std::size_t NumMeasurements(LevelSize size) {
  return std::size_t{size.width_px + 2 * kMeasurementBorder} *
         (size.height_px + 2 * kMeasurementBorder);
}

// Detail (detail.comp) of the reference, of the sources before it and of those after it: of all in
// one buffer there would be too much to bind at 3840x2160.
struct DetailBuffers {
  const Buffer& reference;
  const Buffer& before;
  const Buffer& after;
};

// A step of inverse depth on grey values (shaders/depth/photometric.comp). `measurements` gets four
// floats for each of NumMeasurements.
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
