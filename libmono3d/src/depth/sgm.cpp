// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sgm.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

#include "depth/sgm.params.h"
#include "depth/sgm.spirv.h"
#include "gpu/device_handle.h"

namespace mono3d {

std::array<std::uint32_t, 256> JumpPenalties(const SgmOptions& options) {
  std::array<std::uint32_t, 256> penalties{};
  for (int difference = 0; difference < 256; ++difference) {
    const int falling = options.p2 * options.gradient / (options.gradient + difference);
    penalties[static_cast<std::size_t>(difference)] =
        static_cast<std::uint32_t>(std::max(falling, options.min_p2));
  }
  return penalties;
}

SgmStage::SgmStage(std::shared_ptr<Device> device, const SgmOptions& options)
    : device_(std::move(device)),
      options_(options),
      num_lanes_(Limits(*device_).subgroup_size),
      jump_penalties_(device_, 256 * sizeof(std::uint32_t), "depth/jump_penalties") {
  const auto penalties = JumpPenalties(options_);
  jump_penalties_.Upload(std::span<const std::uint32_t>(penalties));
}

std::uint32_t SgmStage::PaddedPlanes(std::uint32_t num_planes) const {
  // The sweep writes 16 planes at a time, a lane holds whole words of 4.
  const std::uint32_t unit = std::lcm(16u, 4 * num_lanes_);
  return DivideRoundingUp(num_planes, unit) * unit;
}

const Kernel& SgmStage::KernelFor(std::uint32_t padded_planes) {
  const std::uint32_t per_lane = padded_planes / num_lanes_;
  const auto found = kernels_.find(per_lane);
  if (found != kernels_.end()) return found->second;
  return kernels_
      .emplace(per_lane, Kernel(device_, {"depth/sgm", depth_sgm_spirv}, {num_lanes_, per_lane}))
      .first->second;
}

void SgmStage::Record(Recorder& recorder, LevelSize size, std::uint32_t padded_planes,
                      const Buffer& image, const Buffer& costs, const Buffer& sums) {
  const Kernel& kernel = KernelFor(padded_planes);
  bool is_first = true;
  for (const auto& [step_x, step_y] : kPathDirections) {
    const std::uint32_t num_scanlines = step_y == 0 ? size.height_px : size.width_px;
    recorder.Dispatch(
        kernel, {costs, image, jump_penalties_, sums, sums},
        SgmParams{size.width_px, size.height_px, step_x, step_y,
                  static_cast<std::uint32_t>(options_.p1), is_first ? 1u : 0u},
        {DivideRoundingUp(std::uint64_t{num_scanlines} * num_lanes_, kernel.workgroup_size()[0]), 1,
         1});
    is_first = false;
  }
}

}  // namespace mono3d
