// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/plane_sweep.h"

#include <utility>

#include "depth/plane_sweep.spirv.h"

namespace mono3d {

PlaneSweepStage::PlaneSweepStage(std::shared_ptr<Device> device, std::uint32_t side_tolerance)
    : kernels_(std::move(device), {"depth/plane_sweep", depth_plane_sweep_spirv},
               {side_tolerance}) {}

void PlaneSweepStage::Record(Recorder& recorder, std::size_t num_sources,
                             const PlaneSweepParams& params, const Buffer& census,
                             const Buffer& projections, const Buffer& costs) {
  const Kernel& kernel = kernels_.For(num_sources);
  recorder.Dispatch(
      kernel, {census, projections, costs}, params,
      {DivideRoundingUp(params.width_px, kernel.workgroup_size()[0]), params.height_px, 1});
}

}  // namespace mono3d
