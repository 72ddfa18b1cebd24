// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "fusion/anchor_map.h"
#include "fusion/blocks.h"
#include "fusion/kernels.h"
#include "fusion/residency.h"
#include "fusion/storage.h"
#include "fusion/surfel_depot.h"
#include "gpu/recorder.h"
#include "mono3d/core/timing.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

// What the parts of a surfel map work with.
struct FusionContext {
  FusionContext(std::shared_ptr<Device> of_device, SurfelMapOptions of_map, StageTimes* stage_times)
      : device(std::move(of_device)),
        options(std::move(of_map)),
        times(stage_times),
        kernels(device),
        culler(device),
        recorder(device),
        depot(DepotFolder(options.storage), MaxHostBytes(options.storage)) {}

  std::shared_ptr<Device> device;
  SurfelMapOptions options;
  StageTimes* times;
  FusionKernels kernels;
  BlockCuller culler;
  Recorder recorder;
  SurfelDepot depot;  // of what is not on the device
};

// The surfels, and the depth maps in whose frames they lie.
struct SurfelModel {
  SurfelStorage surfels;  // that depth maps have matched
  AnchorMap anchors;
  SurfelStorage inferred;  // what they inferred where there was nothing to match
};

// Of these blocks of surfels, those anchored to depth maps of the submap. `anchor_of`: per block.
inline std::vector<std::uint32_t> BlocksOfSubmap(std::span<const std::uint32_t> blocks,
                                                 std::span<const std::uint32_t> anchor_of,
                                                 const AnchorMap& anchors, int submap) {
  std::vector<std::uint32_t> chosen;
  std::ranges::copy_if(blocks, std::back_inserter(chosen), [&](std::uint32_t block) {
    return anchors.SubmapOf(anchor_of[block]) == submap;
  });
  return chosen;
}

}  // namespace mono3d
