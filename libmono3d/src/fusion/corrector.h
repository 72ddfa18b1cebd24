// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "fusion/deformation.h"
#include "fusion/fusion_stages.h"
#include "fusion/surfel_blocks.h"
#include "fusion/surfel_storage.h"
#include "fusion/view.params.h"
#include "gpu/kernel.h"
#include "gpu/recorder.h"
#include "mono3d/core/timing.h"

namespace mono3d {

// The kernels that move the surfels with their views and merge what comes to lie upon each other.
// What a stage does stands in its shader.
class Corrector {
 public:
  explicit Corrector(const std::shared_ptr<Device>& device);

  // shaders/fusion/deform.comp. `nodes`: one per depth map of the model.
  void Deform(Recorder& recorder, std::span<const DeformationNode> nodes,
              const SurfelStorage& surfels, StageTimes* times);

  // Merges the surfels of parts that overlap as one view sees them, all of which are in `blocks`:
  // overlap_oldest, overlap_candidates, overlap_target, overlap_add, overlap_apply. Returns the
  // number of surfels that were added to others and removed. Keeps 20 bytes per surfel until
  // EndMerging().
  std::uint32_t MergeOverlap(Recorder& recorder, const FusionStages& stages,
                             const ViewParams& params, const DepthMapBuffers& map,
                             const SurfelStorage& surfels, const BlockList& blocks,
                             StageTimes* times);
  void EndMerging() {
    sums_ = Buffer();
    candidates_ = Buffer();
  }

 private:
  void Reserve(Recorder& recorder, const ViewParams& params, const SurfelStorage& surfels);

  std::shared_ptr<Device> device_;
  Kernel deform_;
  Kernel overlap_oldest_;
  Kernel overlap_candidates_;
  Kernel overlap_target_;
  Kernel overlap_add_;
  Kernel overlap_apply_;
  Buffer sums_;        // four uints per surfel; 0 but from overlap_add to overlap_apply
  Buffer oldest_;      // uint per tile of the index map
  Buffer candidates_;  // number of a surfel, each
  Buffer num_candidates_;
  Buffer is_marked_;  // uint per block
  BlockList marked_;
};

}  // namespace mono3d
