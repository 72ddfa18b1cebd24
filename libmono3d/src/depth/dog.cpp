// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/dog.h"

#include <utility>

#include "depth/dog.params.h"
#include "depth/dog.spirv.h"

namespace mono3d {

DogStage::DogStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/dog", depth_dog_spirv}) {}

void DogStage::Record(Recorder& recorder, const Buffer& image, LevelSize size,
                      const Buffer& response) const {
  recorder.Dispatch(
      kernel_, {image, response}, DogParams{size.width_px, size.height_px},
      {DivideRoundingUp(size.groups_per_row(), kernel_.workgroup_size()[0]), size.height_px, 1});
}

}  // namespace mono3d
