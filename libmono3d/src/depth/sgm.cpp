// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sgm.h"

#include <algorithm>
#include <span>
#include <utility>

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

SgmPenalties UploadPenalties(std::shared_ptr<Device> device, const SgmOptions& options) {
  const std::array<std::uint32_t, 256> p2 = JumpPenalties(options);
  SgmPenalties penalties{.p1 = static_cast<std::uint32_t>(options.p1),
                         .p2 = Buffer(std::move(device), sizeof(p2), "depth/jump_penalties"),
                         .min_p2 = static_cast<std::uint32_t>(options.min_p2),
                         .p2_times_gradient = static_cast<float>(options.p2 * options.gradient),
                         .gradient = static_cast<float>(options.gradient)};
  penalties.p2.Upload(std::span<const std::uint32_t>(p2));
  return penalties;
}

}  // namespace mono3d
