// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/local_winner.h"

#include <utility>

#include "depth/local_winner.spirv.h"

namespace mono3d {

LocalWinnerStage::LocalWinnerStage(std::shared_ptr<Device> device, std::uint32_t num_paths,
                                   bool sub_plane)
    : kernel_(std::move(device), {"depth/local_winner", depth_local_winner_spirv},
              {num_paths == kNumPaths ? 1u : 0u, sub_plane ? 1u : 0u}) {}

void LocalWinnerStage::Record(Recorder& recorder, const LocalWinnerParams& params,
                              const Buffer& paths, const Buffer& more_paths, const Buffer& costs,
                              const Buffer& ranges, const Buffer& inverse_depth,
                              const Buffer& uniqueness) const {
  recorder.Dispatch(
      kernel_, {paths, more_paths, costs, ranges, inverse_depth, uniqueness}, params,
      {DivideRoundingUp(std::uint64_t{8} * params.height_px, kernel_.workgroup_size()[0]),
       DivideRoundingUp(params.width_px, 8), 1});
}

}  // namespace mono3d
