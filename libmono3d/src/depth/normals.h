// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/normals.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// Normals from inverse depth (shaders/depth/normals.comp): three floats for each pixel.
class NormalsStage {
 public:
  explicit NormalsStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const NormalsParams& params, const Buffer& inverse_depth,
              const Buffer& normals) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
