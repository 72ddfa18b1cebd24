// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/surface.h"

#include <utility>

#include "depth/surface.spirv.h"

namespace mono3d {

SurfaceStage::SurfaceStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/surface", depth_surface_spirv}) {}

void SurfaceStage::Record(Recorder& recorder, const SurfaceParams& params,
                          const Buffer& measurements, const Buffer& inverse_depth,
                          const Buffer& confidence) const {
  recorder.Dispatch(
      kernel_, {measurements, inverse_depth, confidence}, params,
      {DivideRoundingUp(params.width_px, kernel_.workgroup_size()[0]), params.height_px, 1});
}

}  // namespace mono3d
