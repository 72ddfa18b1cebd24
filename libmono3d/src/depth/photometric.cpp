// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/photometric.h"

#include <utility>

#include "depth/photometric.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kPhotometricRowsPerInvocation = 16;

}  // namespace

PhotometricStage::PhotometricStage(std::shared_ptr<Device> device)
    : kernels_(std::move(device), {"depth/photometric", depth_photometric_spirv}) {}

void PhotometricStage::Record(Recorder& recorder, std::size_t num_sources,
                              const PhotometricParams& params, const DetailBuffers& detail,
                              const Buffer& projections, const Buffer& inverse_depth,
                              const Buffer& measurements) {
  const Kernel& kernel = kernels_.For(num_sources);
  recorder.Dispatch(
      kernel,
      {detail.reference, detail.before, detail.after, projections, inverse_depth, measurements},
      params,
      {DivideRoundingUp(params.width_px + 2 * kMeasurementBorder, kernel.workgroup_size()[0]),
       DivideRoundingUp(params.height_px + 2 * kMeasurementBorder, kPhotometricRowsPerInvocation),
       1});
}

}  // namespace mono3d
