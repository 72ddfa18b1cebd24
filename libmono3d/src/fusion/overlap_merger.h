// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "fusion/anchor_table.h"
#include "fusion/blocks.h"
#include "fusion/kernels.h"
#include "fusion/storage.h"
#include "fusion/view.params.h"
#include "gpu/kernel.h"
#include "gpu/recorder.h"
#include "mono3d/core/timing.h"

namespace mono3d {

// Merges surfels of parts of the model that have come to lie upon each other. What a stage does
// stands in its shader.
class OverlapMerger {
 public:
  explicit OverlapMerger(const std::shared_ptr<Device>& device);

  // Merges the surfels of parts that overlap as one view sees them, all of which are in `blocks`:
  // overlap_oldest, overlap_candidates, overlap_target, overlap_add, overlap_apply. `end_of_older`:
  // per anchor the end of the surfels of older parts in that list. Returns the number of surfels
  // that were added to others and removed. Keeps 20 bytes per surfel, and an index map, until
  // End().
  std::uint32_t Merge(Recorder& recorder, const FusionKernels& kernels, const ViewParams& params,
                      const AnchorTable& anchors, std::span<const std::uint32_t> end_of_older,
                      const SurfelStorage& surfels, const BlockList& blocks, StageTimes* times);
  void End();

 private:
  void Reserve(Recorder& recorder, const ViewParams& params, const SurfelStorage& surfels);

  std::shared_ptr<Device> device_;
  Kernel overlap_oldest_;
  Kernel overlap_candidates_;
  Kernel overlap_target_;
  Kernel overlap_add_;
  Kernel overlap_apply_;
  Buffer index_map_;   // as DepthMapBuffers has it
  Buffer sums_;        // four uints per surfel; 0 but from overlap_add to overlap_apply
  Buffer oldest_;      // uint per tile of the index map
  Buffer candidates_;  // number of a surfel, each
  Buffer num_candidates_;
  Buffer num_removed_;
  Buffer is_marked_;  // uint per block
  BlockList marked_;
};

}  // namespace mono3d
