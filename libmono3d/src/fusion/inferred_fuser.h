// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/depth_map_buffers.h"
#include "fusion/fusion_context.h"
#include "fusion/past_views.h"

namespace mono3d {

// Fuses what depth maps infer where they match nothing, into surfels of their own
// (SurfelModel::inferred). What is matched never sees these: registration, exposure and the matched
// surfels are the same with them and without. They give way where a depth map matches the same
// surface, and free space that a depth map matches removes them; they take up one another.
class InferredFuser {
 public:
  InferredFuser(FusionContext& context, SurfelModel& model) : context_(context), model_(model) {}

  // A depth map that is being fused, as what it matched was.
  struct View {
    ViewParams params;
    const AnchorTable& anchors;  // as its camera has them
    // What it matched; colours corrected, the matched surfels drawn into index_map.
    const DepthMapBuffers& buffers;
    const BlockList& visible;  // matched surfels that it may see
    std::uint32_t number = 0;  // its anchor's
    int submap = 0;
  };

  // Removes what stands where it matched a surface, and what it sees through.
  void GiveWay(const View& view);
  // Takes up what it infers where the model has nothing matched in sight; `past` views may have
  // seen through that. `colours`: corrected, empty where it has no image. Returns the number of
  // pixels that became or confirmed a surfel.
  std::int64_t Fuse(const View& view, const DepthMap& map, std::span<const std::uint32_t> colours,
                    PastViews& past);

  // Lets go of the memory that is needed only while depth maps come.
  void Rest();
  // Anchors of which the latest depth map may have changed inferred surfels.
  const std::vector<std::uint32_t>& changed_anchors() const { return changed_anchors_; }

 private:
  void FindVisible(const View& view);
  std::int64_t Write(const DepthMap& map, std::span<const std::uint32_t> colours);
  std::vector<std::uint32_t> SelectUncovered(const View& view);
  void Review(const ViewParams& of_map, std::span<const BlockSphere> spheres, PastViews& past);

  FusionContext& context_;
  SurfelModel& model_;
  DepthMapBuffers buffers_;            // of what is inferred
  std::vector<std::uint32_t> pixels_;  // of that
  BlockList visible_;                  // inferred surfels
  BlockList added_;                    // of what is new
  int width_px_ = 0;
  int height_px_ = 0;
  std::vector<std::uint32_t> changed_anchors_;
};

}  // namespace mono3d
