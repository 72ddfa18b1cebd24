// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/winner_takes_all.h"

#include <utility>

#include "depth/winner_takes_all.spirv.h"

namespace mono3d {

WinnerTakesAllStage::WinnerTakesAllStage(std::shared_ptr<Device> device, bool sub_plane)
    : kernel_(std::move(device), {"depth/winner_takes_all", depth_winner_takes_all_spirv},
              {sub_plane ? 1u : 0u}) {}

void WinnerTakesAllStage::Record(Recorder& recorder, const WinnerTakesAllParams& params,
                                 const Buffer& sums, const Buffer& costs,
                                 const Buffer& inverse_depth, const Buffer& uniqueness) const {
  recorder.Dispatch(
      kernel_, {sums, costs, inverse_depth, uniqueness}, params,
      {DivideRoundingUp(params.width_px, kernel_.workgroup_size()[0]), params.height_px, 1});
}

}  // namespace mono3d
