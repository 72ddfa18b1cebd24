// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/surface.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// Inverse depth and confidence of the surface through each pixel (shaders/depth/surface.comp).
// `measurements` is that of PhotometricStage; the confidence is only written when asked for.
class SurfaceStage {
 public:
  explicit SurfaceStage(std::shared_ptr<Device> device, bool with_confidence = true);

  void Record(Recorder& recorder, const SurfaceParams& params, const Buffer& measurements,
              const Buffer& uniqueness, const Buffer& inverse_depth,
              const Buffer& confidence) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
