// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "fusion/depth_map_buffers.h"
#include "fusion/exposure.h"
#include "fusion/fusion_context.h"
#include "fusion/inferred_fuser.h"
#include "fusion/new_blocks.h"
#include "fusion/past_views.h"

namespace mono3d {

// Makes a depth map a part of the model where it has been placed: surfels that it confirms take it
// up, new ones are inserted, those that it speaks against go.
class DepthMapFuser {
 public:
  DepthMapFuser(FusionContext& context, SurfelModel& model)
      : context_(context),
        model_(model),
        inferred_(context, model),
        past_views_(static_cast<std::size_t>(context.options.num_reviews)) {}

  // Takes over the depth map. False where it has no estimate.
  bool Upload(const DepthMap& map);
  const DepthMapBuffers& buffers() const { return buffers_; }

  struct Counts {
    std::int64_t num_merged = 0;
    std::int64_t num_inserted = 0;
    std::int64_t num_removed = 0;
    std::int64_t num_inferred = 0;  // pixels that became or confirmed an inferred surfel
    Exposure exposure;              // of its image, against the model's colours
  };
  // Fuses what was uploaded as the next anchor, of this submap, and behind it what the `whole`
  // depth map infers. Where there is no room for its new surfels, the model becomes coarser.
  // Nothing, with the model as it was or coarser, where that is not enough; num_wanted() new
  // surfels were to be inserted then.
  std::optional<Counts> Fuse(const DepthMap& map, const DepthMap& whole, const Anchor& anchor,
                             const Similarity& S_world_kf, int submap);
  std::uint32_t num_wanted() const { return num_new_; }

  // Runs `look`, which finds what a view sees; where that is more than the device has room for, the
  // model becomes coarser, and it is run again. False where the model is as coarse as it may be.
  bool Look(const std::function<void()>& look);

  // Depth maps of the past say no more of new surfels.
  void ForgetPastViews() { past_views_.Clear(); }
  // Lets go of the memory that is needed only while depth maps come.
  void Rest();
  // New surfels are so many pixels apart; more than 1 where the model was too large.
  std::uint32_t merge_radius_px() const { return merge_radius_px_; }
  void SetMergeRadius(std::uint32_t radius_px) { merge_radius_px_ = radius_px; }

  // Anchors whose surfels the latest depth map may have changed, but its own.
  const std::vector<std::uint32_t>& changed_anchors() const { return changed_anchors_; }

  PastViews& past_views() { return past_views_; }
  // For a saved state, without the past views; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  ViewParams Params(const DepthMap& map) const;
  void Associate(const DepthMap& map, int submap);
  Exposure CorrectColours(const DepthMap& map);
  std::int64_t FuseInferred(const DepthMap& map, const DepthMap& whole, std::uint32_t number,
                            int submap);
  std::uint32_t ChangeSurfels(const DepthMap& map, std::uint32_t number);
  void NoteChanges();
  void ReviewNew(const ViewParams& of_map, std::uint32_t number);
  bool Coarsen();

  FusionContext& context_;
  SurfelModel& model_;
  DepthMapBuffers buffers_;
  AnchorTable anchors_;  // as the depth map's camera has them
  BlockList visible_;    // what the stages work on
  BlockList compared_;   // of those, for the exposure
  BlockList added_;      // of what is new
  InferredFuser inferred_;
  PastViews past_views_;
  std::vector<std::uint32_t> colours_;    // of its image, corrected; empty without one
  std::int64_t num_candidates_ = 0;       // of what was uploaded
  std::vector<BlockSphere> new_spheres_;  // of those, block by block
  std::uint32_t num_new_ = 0;             // pixels that become a surfel, as Associate found
  std::uint32_t merge_radius_px_ = 1;
  Exposure latest_exposure_;  // of the depth map fused last
  int width_px_ = 0;
  int height_px_ = 0;
  std::vector<std::uint32_t> changed_anchors_;
};

}  // namespace mono3d
