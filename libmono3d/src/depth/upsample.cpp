// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/upsample.h"

#include <utility>

#include "depth/upsample.spirv.h"

namespace mono3d {

UpsampleStage::UpsampleStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/upsample", depth_upsample_spirv}) {}

void UpsampleStage::Record(Recorder& recorder, const UpsampleParams& params,
                           const Buffer& coarse_depth, const Buffer& coarse_confidence,
                           const Buffer& inverse_depth, const Buffer& confidence) const {
  recorder.Dispatch(
      kernel_, {coarse_depth, coarse_confidence, inverse_depth, confidence}, params,
      {DivideRoundingUp(params.width_px, kernel_.workgroup_size()[0]), params.height_px, 1});
}

}  // namespace mono3d
