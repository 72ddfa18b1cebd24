// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/normals.h"

#include <utility>

#include "depth/normals.spirv.h"

namespace mono3d {

NormalsStage::NormalsStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/normals", depth_normals_spirv}) {}

void NormalsStage::Record(Recorder& recorder, const NormalsParams& params,
                          const Buffer& inverse_depth, const Buffer& normals) const {
  recorder.Dispatch(kernel_, {inverse_depth, normals}, params,
                    {DivideRoundingUp((params.width_px + 3) / 4, kernel_.workgroup_size()[0]),
                     params.height_px, 1});
}

}  // namespace mono3d
