// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/photometric.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// A step of inverse depth on grey values (shaders/depth/photometric.comp). `detail` holds the
// reference and the first two sources, `more_detail` the other two; `measurements` gets four floats
// for each pixel.
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
