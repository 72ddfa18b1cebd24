// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/local_sgm.h"

#include <span>
#include <utility>

#include "depth/local_sgm.params.h"
#include "depth/local_sgm.spirv.h"
#include "depth/sgm.h"

namespace mono3d {

LocalSgmStage::LocalSgmStage(std::shared_ptr<Device> device, const SgmOptions& options)
    : options_(options),
      kernel_(device, {"depth/local_sgm", depth_local_sgm_spirv}),
      jump_penalties_(std::move(device), 256 * sizeof(std::uint32_t), "depth/jump_penalties") {
  const auto penalties = JumpPenalties(options_);
  jump_penalties_.Upload(std::span<const std::uint32_t>(penalties));
}

void LocalSgmStage::Record(Recorder& recorder, LevelSize size, const Buffer& costs,
                           const Buffer& ranges, const Buffer& paths, const Buffer& more_paths,
                           std::uint32_t num_paths) const {
  const auto num_pixels = static_cast<std::uint32_t>(NumLocalPixels(size));
  for (std::uint32_t i = 0; i < num_paths; ++i) {
    const auto& [step_x, step_y] = kPathDirections[i];
    const std::uint32_t num_scanlines = step_y == 0 ? size.height_px : size.width_px;
    recorder.Dispatch(kernel_, {costs, ranges, jump_penalties_, i < 4 ? paths : more_paths},
                      LocalSgmParams{.width_px = size.width_px,
                                     .height_px = size.height_px,
                                     .step_x = step_x,
                                     .step_y = step_y,
                                     .direction = i,
                                     .p1 = static_cast<std::uint32_t>(options_.p1),
                                     .first_texel = i % 4 * num_pixels},
                      {DivideRoundingUp(num_scanlines, kernel_.workgroup_size()[0]), 1, 1});
  }
}

}  // namespace mono3d
