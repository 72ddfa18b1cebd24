// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <string>

#include "mono3d/depth/depth_estimator.h"

namespace mono3d {
namespace {

// Costs are at most 124 and a byte holds 255 for "not seen", which must lose against every seen
// plane, whatever jump leads to it: 124 + P2 < 255.
constexpr int kMaxP2 = 130;

}  // namespace

void PyramidOptions::Visit(OptionVisitor& visit) {
  visit("level", level, "halvings of the images on the finest level, 0: full resolution");
  visit("num_levels", num_levels, "levels from coarse to fine, 0: from the image size");
}

void PlaneSweepOptions::Visit(OptionVisitor& visit) {
  visit("min_depth_su", min_depth_su, "nearest depth, scene units; 0: found out");
  visit("max_depth_su", max_depth_su, "farthest depth, scene units; 0: found out");
  visit("max_planes", max_planes, "with more planes a coarser level is swept");
  visit("side_tolerance", side_tolerance,
        "how much worse than the better of the images before and after a match may be, half bits");
}

void SgmOptions::Visit(OptionVisitor& visit) {
  visit("p1", p1, "penalty for a step of one plane, in half census bits");
  visit("p2", p2, "penalty for a larger jump where the image is flat");
  visit("min_p2", min_p2, "the same across the strongest image edges");
  visit("gradient", gradient, "grey levels of difference that halve p2");
  visit("follow_normals", follow_normals,
        "SGM^sn: steps along the surface of the level above cost nothing");
  visit("finest_paths", finest_paths, "paths of the finest level of several: 4 or 8");
}

void WinnerTakesAllOptions::Visit(OptionVisitor& visit) {
  visit("max_cost", max_cost, "largest matching cost of an estimate, in half census bits");
  visit("min_uniqueness", min_uniqueness, "share by which any other plane must be worse");
  visit("sub_plane", sub_plane, "interpolate between the planes");
}

void MedianOptions::Visit(OptionVisitor& visit) {
  visit("min_support", min_support, "pixels of 25 that must agree with the median, 0: no median");
}

void RefinementOptions::Visit(OptionVisitor& visit) {
  visit("iterations", iterations, "photometric steps after the sweep, 0: none");
  visit("min_views", min_views, "matching images that must see a point");
}

void DogOptions::Visit(OptionVisitor& visit) {
  visit("min_response", min_response,
        "texture below this has no depth, grey levels a grey level of noise");
}

void InferenceOptions::Visit(OptionVisitor& visit) {
  visit(
      "enabled", enabled,
      "depth of what was not matched in full, from the surface around it and from coarser levels");
  visit("max_difference", max_difference, "planes between it and the best match of the pixel");
}

void DepthEstimatorOptions::Visit(OptionVisitor& visit) {
  visit.Group("pyramid", pyramid);
  visit.Group("plane_sweep", plane_sweep);
  visit.Group("sgm", sgm);
  visit.Group("winner_takes_all", winner_takes_all);
  visit.Group("median", median);
  visit.Group("refinement", refinement);
  visit.Group("dog", dog);
  visit.Group("inference", inference);
}

void DepthEstimatorOptions::Validate() const {
  const auto require_int = [](int value, int least, int most, const char* name) {
    RequireOption(value >= least && value <= most, name,
                  std::to_string(least) + " to " + std::to_string(most), value);
  };
  require_int(pyramid.level, 0, 6, "depth.pyramid.level");
  require_int(pyramid.num_levels, 0, 7, "depth.pyramid.num_levels");
  require_int(plane_sweep.max_planes, 16, 256, "depth.plane_sweep.max_planes");
  RequireOption(plane_sweep.min_depth_su >= 0, "depth.plane_sweep.min_depth_su", "0 or more",
                plane_sweep.min_depth_su);
  RequireOption(
      plane_sweep.max_depth_su == 0 || plane_sweep.max_depth_su > plane_sweep.min_depth_su,
      "depth.plane_sweep.max_depth_su", "0 or more than min_depth_su", plane_sweep.max_depth_su);
  require_int(plane_sweep.side_tolerance, 0, 64, "depth.plane_sweep.side_tolerance");
  require_int(sgm.p1, 0, kMaxP2, "depth.sgm.p1");
  require_int(sgm.p2, sgm.p1, kMaxP2, "depth.sgm.p2");
  require_int(sgm.min_p2, sgm.p1, sgm.p2, "depth.sgm.min_p2");
  require_int(sgm.gradient, 1, 255, "depth.sgm.gradient");
  RequireOption(sgm.finest_paths == 4 || sgm.finest_paths == 8, "depth.sgm.finest_paths", "4 or 8",
                sgm.finest_paths);
  require_int(winner_takes_all.max_cost, 0, 124, "depth.winner_takes_all.max_cost");
  RequireOption(winner_takes_all.min_uniqueness >= 0 && winner_takes_all.min_uniqueness < 1,
                "depth.winner_takes_all.min_uniqueness", "0 to less than 1",
                winner_takes_all.min_uniqueness);
  require_int(median.min_support, 0, 25, "depth.median.min_support");
  require_int(refinement.iterations, 0, 10, "depth.refinement.iterations");
  require_int(refinement.min_views, 1, static_cast<int>(kMaxBundleSize) - 1,
              "depth.refinement.min_views");
  RequireOption(dog.min_response >= 0 && dog.min_response <= 255, "depth.dog.min_response",
                "0 to 255", dog.min_response);
  RequireOption(inference.max_difference > 0, "depth.inference.max_difference", "above 0",
                inference.max_difference);
}

const char* ToString(DepthEffort effort) {
  switch (effort) {
    case DepthEffort::kFull:
      return "full";
    case DepthEffort::kMatchedOnly:
      return "matched only";
    case DepthEffort::kRefinedOnce:
      return "refined once";
    case DepthEffort::kHalfSize:
      return "half size";
  }
  return "unknown";
}

DepthEstimatorOptions WithEffort(const DepthEstimatorOptions& options, DepthEffort effort) {
  DepthEstimatorOptions less = options;
  if (effort == DepthEffort::kHalfSize) return less;
  if (effort >= DepthEffort::kMatchedOnly) less.inference.enabled = false;
  if (effort >= DepthEffort::kRefinedOnce) {
    less.refinement.iterations = std::min(less.refinement.iterations, 1);
  }
  return less;
}

}  // namespace mono3d
