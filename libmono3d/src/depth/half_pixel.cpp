// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/half_pixel.h"

#include <utility>

#include "depth/half_pixel.params.h"
#include "depth/half_pixel.spirv.h"

namespace mono3d {

HalfPixelStage::HalfPixelStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/half_pixel", depth_half_pixel_spirv}) {}

void HalfPixelStage::Record(Recorder& recorder, const Buffer& images, LevelSize size,
                            std::uint32_t num_images, const Buffer& shifted) const {
  recorder.Dispatch(kernel_, {images, shifted}, HalfPixelParams{size.width_px, size.height_px},
                    {DivideRoundingUp(PaddedWordsPerRow(size), kernel_.workgroup_size()[0]),
                     PaddedRows(size), num_images});
}

}  // namespace mono3d
