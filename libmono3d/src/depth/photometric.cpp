// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/photometric.h"

#include <utility>

#include "depth/photometric.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kRowsPerInvocation = 16;

}  // namespace

PhotometricStage::PhotometricStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/photometric", depth_photometric_spirv}) {}

void PhotometricStage::Record(Recorder& recorder, const PhotometricParams& params,
                              const Buffer& detail, const Buffer& more_detail,
                              const Buffer& projections, const Buffer& inverse_depth,
                              const Buffer& measurements) const {
  recorder.Dispatch(
      kernel_, {detail, more_detail, projections, inverse_depth, measurements}, params,
      {DivideRoundingUp(params.width_px + 2 * kMeasurementBorder, kernel_.workgroup_size()[0]),
       DivideRoundingUp(params.height_px + 2 * kMeasurementBorder, kRowsPerInvocation), 1});
}

}  // namespace mono3d
