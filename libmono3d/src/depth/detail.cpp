// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/detail.h"

#include <utility>

#include "depth/detail.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kDetailRowsPerInvocation = 4;

}  // namespace

DetailStage::DetailStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/detail", depth_detail_spirv}) {}

void DetailStage::Record(Recorder& recorder, const DetailParams& params, std::uint32_t num_images,
                         const Buffer& images, const Buffer& quarter, const Buffer& detail) const {
  recorder.Dispatch(kernel_, {images, quarter, detail}, params,
                    {DivideRoundingUp((params.width_px + 3) / 4, kernel_.workgroup_size()[0]),
                     DivideRoundingUp(params.height_px, kDetailRowsPerInvocation), num_images});
}

}  // namespace mono3d
