// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <vector>

#include "fusion/fusion_context.h"
#include "fusion/part_merger.h"
#include "fusion/registration/misfit_history.h"
#include "fusion/registration/registrar.h"

namespace mono3d {

// Where a depth map goes.
struct Placement {
  Registration registration;
  int submap = 0;
  bool starts_submap = false;
  std::optional<SubmapJoin> join;
  std::vector<KeyframeConstraint> constraints;
};

// Finds where in the model a depth map goes, by registration with the submaps that it shows. Where
// it is sure of two, they become one first; where it shows none, it is the first of a new one.
class DepthMapPlacer {
 public:
  DepthMapPlacer(FusionContext& context, SurfelModel& model, PartMerger& merger)
      : context_(context), model_(model), merger_(merger), registrar_(context.device) {}

  // `anchor`: what it will be, where the tracker has it. `buffers` hold it, with its candidates.
  Placement Place(const DepthMap& map, const Anchor& anchor, const DepthMapBuffers& buffers);
  // The tracker is, or is no more, expected to be off as it was with the latest depth map.
  void SetTrackerDrifted(bool has_drifted) { tracker_drifted_ = has_drifted; }
  bool tracker_drifted() const { return tracker_drifted_; }

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  // What one submap makes of a depth map.
  struct SubmapRegistration {
    int submap = 0;
    Registration registration;
  };

  Predictions Predict(const Similarity& S_tracker_kf) const;
  void FindVisible(const DepthMap& map, const Predictions& predictions);
  Registration Register(const DepthMap& map, const Anchor& anchor, const Predictions& predictions,
                        const DepthMapBuffers& buffers, const BlockList& blocks);
  std::vector<SubmapRegistration> RegisterWithSubmaps(const DepthMap& map, const Anchor& anchor,
                                                      const Predictions& predictions,
                                                      const DepthMapBuffers& buffers);
  std::optional<SubmapJoin> JoinSubmaps(const DepthMap& map, std::vector<SubmapRegistration>& shown,
                                        std::vector<KeyframeConstraint>& constraints);
  void MoveToOldest(const DepthMap& map, const SubmapRegistration& other,
                    const SubmapRegistration& oldest, SubmapJoin& join);

  FusionContext& context_;
  SurfelModel& model_;
  PartMerger& merger_;
  Registrar registrar_;
  MisfitHistory misfits_;
  BlockList visible_;
  BlockList of_submap_;
  std::vector<AnchorTable> predicted_anchors_;  // per prediction
  bool tracker_drifted_ = false;  // the latest depth map was not where the tracker put it
};

}  // namespace mono3d
