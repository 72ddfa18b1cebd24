// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/median.h"

#include <utility>

#include "depth/median.spirv.h"

namespace mono3d {

MedianStage::MedianStage(std::shared_ptr<Device> device, bool with_confidence)
    : kernel_(std::move(device), {"depth/median", depth_median_spirv},
              {with_confidence ? 1u : 0u}) {}

void MedianStage::Record(Recorder& recorder, const MedianParams& params,
                         const Buffer& inverse_depth, const Buffer& confidence,
                         const Buffer& median_depth, const Buffer& median_confidence) const {
  recorder.Dispatch(kernel_, {inverse_depth, confidence, median_depth, median_confidence}, params,
                    {DivideRoundingUp((params.width_px + 3) / 4, kernel_.workgroup_size()[0]),
                     params.height_px, 1});
}

}  // namespace mono3d
