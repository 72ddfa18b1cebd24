// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/texture_filter.h"

#include <utility>

#include "depth/texture_filter.spirv.h"

namespace mono3d {

TextureFilterStage::TextureFilterStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/texture_filter", depth_texture_filter_spirv}) {}

void TextureFilterStage::Record(Recorder& recorder, const TextureFilterParams& params,
                                const Buffer& response, const Buffer& inverse_depth,
                                const Buffer& confidence, const Buffer& depth,
                                const Buffer& filtered_confidence) const {
  recorder.Dispatch(kernel_, {response, inverse_depth, confidence, depth, filtered_confidence},
                    params,
                    {DivideRoundingUp((params.width_px + 3) / 4, kernel_.workgroup_size()[0]),
                     params.height_px, 1});
}

}  // namespace mono3d
