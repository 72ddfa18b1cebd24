// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/prior.h"

#include <utility>

#include "depth/prior.spirv.h"

namespace mono3d {

PriorStage::PriorStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/prior", depth_prior_spirv}) {}

void PriorStage::Record(Recorder& recorder, const PriorParams& params, const Buffer& coarse_depth,
                        const Buffer& coarse_normal, const Buffer& image,
                        const Buffer& ranges) const {
  recorder.Dispatch(kernel_, {coarse_depth, coarse_normal, image, ranges}, params,
                    {DivideRoundingUp(params.coarse_width_px, kernel_.workgroup_size()[0]),
                     params.coarse_height_px, 1});
}

}  // namespace mono3d
