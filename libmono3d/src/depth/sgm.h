// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "depth/padded_image.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// Steps of the eight paths. Opposite directions in turn, so that each half of the sums is still in
// the cache where it can be.
inline constexpr std::array<std::array<int, 2>, 8> kPathDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, -1}}};

// P2 for each absolute difference of the grey values of neighbours.
std::array<std::uint32_t, 256> JumpPenalties(const SgmOptions& options);

// Semi-global matching over eight paths (shaders/depth/sgm.comp).
class SgmStage {
 public:
  SgmStage(std::shared_ptr<Device> device, const SgmOptions& options);

  // Planes are spread over the lanes of a subgroup in whole words: the least multiple of this that
  // holds them.
  std::uint32_t PaddedPlanes(std::uint32_t num_planes) const;

  // `image` holds padded grey images, the reference first; `costs` holds `padded_planes` bytes for
  // each pixel, `sums` gets as many 16-bit sums.
  void Record(Recorder& recorder, LevelSize size, std::uint32_t padded_planes, const Buffer& image,
              const Buffer& costs, const Buffer& sums);

 private:
  const Kernel& KernelFor(std::uint32_t padded_planes);

  std::shared_ptr<Device> device_;
  SgmOptions options_;
  std::uint32_t num_lanes_;
  std::map<std::uint32_t, Kernel> kernels_;  // by planes per lane
  Buffer jump_penalties_;
};

}  // namespace mono3d
