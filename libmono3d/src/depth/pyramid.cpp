// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/pyramid.h"

#include <utility>

#include "depth/pyramid.params.h"
#include "depth/pyramid.spirv.h"

namespace mono3d {

PyramidStage::PyramidStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/pyramid", depth_pyramid_spirv}) {}

void PyramidStage::Record(Recorder& recorder, const Buffer& fine, LevelSize size,
                          std::uint32_t num_images, const Buffer& coarse) const {
  const LevelSize half = size.Halved();
  recorder.Dispatch(kernel_, {fine, coarse}, PyramidParams{size.width_px, size.height_px},
                    {DivideRoundingUp(PaddedWordsPerRow(half), kernel_.workgroup_size()[0]),
                     PaddedRows(half), num_images});
}

}  // namespace mono3d
