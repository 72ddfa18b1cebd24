// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "depth/padded_image.h"
#include "depth/photometric.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// Of zeros around the measurements: the radius of the window of SurfaceStage.
inline constexpr std::uint32_t kMeasurementBorder = 3;

// In rows from the top, with the border.
inline std::size_t NumMeasurements(LevelSize size) {
  return std::size_t{size.width_px + 2 * kMeasurementBorder} *
         (size.height_px + 2 * kMeasurementBorder);
}

// A step of inverse depth on grey values (shaders/depth/photometric.comp). `detail` holds the
// reference and the first two sources, `more_detail` the other two; `measurements` gets four floats
// for each of NumMeasurements.
class PhotometricStage {
 public:
  explicit PhotometricStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const PhotometricParams& params, const Buffer& detail,
              const Buffer& more_detail, const Buffer& projections, const Buffer& inverse_depth,
              const Buffer& measurements) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
