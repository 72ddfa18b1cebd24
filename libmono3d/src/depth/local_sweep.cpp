// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/local_sweep.h"

#include <utility>

#include "depth/local_sweep.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kLocalSweepRowsPerInvocation = 16;  // of pixels, in blocks of 2x2

}  // namespace

LocalSweepStage::LocalSweepStage(std::shared_ptr<Device> device, std::uint32_t side_tolerance)
    : kernels_(std::move(device), {"depth/local_sweep", depth_local_sweep_spirv},
               {side_tolerance}) {}

void LocalSweepStage::Record(Recorder& recorder, std::size_t num_sources,
                             const LocalSweepParams& params, const Buffer& census,
                             const Buffer& projections, const Buffer& ranges, const Buffer& costs) {
  const Kernel& kernel = kernels_.For(num_sources);
  recorder.Dispatch(kernel, {census, projections, ranges, costs}, params,
                    {DivideRoundingUp((params.width_px + 1) / 2, kernel.workgroup_size()[0]),
                     DivideRoundingUp(params.height_px, kLocalSweepRowsPerInvocation), 1});
}

}  // namespace mono3d
