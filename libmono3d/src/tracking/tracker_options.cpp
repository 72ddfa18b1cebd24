// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/error.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d {

const char* ToString(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kNotInitialised:
      return "not initialised";
    case TrackingStatus::kTracking:
      return "tracking";
    case TrackingStatus::kLost:
      return "lost";
  }
  return "unknown";
}

void FeatureOptions::Visit(OptionVisitor& visit) {
  visit("num_features", num_features,
        "ORB features per image; twice as many while there is no map");
  visit("num_levels", num_levels, "levels of the image pyramid");
  visit("scale_factor", scale_factor, "size of a level over the size of the next");
  visit("fast_threshold", fast_threshold, "FAST threshold in grey values");
  visit("min_fast_threshold", min_fast_threshold, "FAST threshold in cells of weak texture");
  visit("patch_sigma_px", patch_sigma_px,
        "standard deviation of where a point is found, besides the noise of the image");
}

void InitialisationOptions::Visit(OptionVisitor& visit) {
  visit("min_matches", min_matches, "matches between the two first views");
  visit("min_points", min_points, "points triangulated from them");
  visit("min_parallax_deg", min_parallax_deg, "parallax of the 50th best point");
  visit("search_radius_share", search_radius_share, "search radius over the image width");
  visit("max_wait_s", max_wait_s, "time after which the first view is given up");
  visit("max_kept_mb", max_kept_mb,
        "megabytes of images that wait for a pose, to be tracked after the start");
}

void KeyframeInsertionOptions::Visit(OptionVisitor& visit) {
  visit("max_rotation_deg", max_rotation_deg, "largest rotation between neighbours");
  visit("max_baseline_share", max_baseline_share,
        "largest baseline between neighbours over the median depth");
  visit("min_baseline_share", min_baseline_share,
        "smallest baseline between neighbours over the median depth");
  visit("min_tracked_share", min_tracked_share,
        "share of the reference keyframe's points below which a new keyframe is due");
  visit("min_inliers", min_inliers, "map points that a keyframe must rest on");
}

void LocalMappingOptions::Visit(OptionVisitor& visit) {
  visit("num_neighbours", num_neighbours,
        "covisible keyframes that new points are triangulated with");
  visit("min_baseline_share", min_baseline_share,
        "smallest baseline for triangulation over the median depth");
  visit("num_adjusted_keyframes", num_adjusted_keyframes, "keyframes of a local bundle adjustment");
  visit("num_fixed_keyframes", num_fixed_keyframes, "further ones that hold it");
  visit("max_redundant_share", max_redundant_share,
        "share of points seen by three others above which a keyframe is culled");
}

void TrackerOptions::Visit(OptionVisitor& visit) {
  visit("mode", mode, "sequential, or live: mapping in a thread of its own");
  visit("max_side_px", max_side_px,
        "larger images are tracked on smaller ones of this longer side");
  visit.Group("features", features);
  visit.Group("initialisation", initialisation);
  visit.Group("insertion", insertion);
  visit.Group("mapping", mapping);
  visit("with_constraints", with_constraints,
        "model-to-tracker constraints may move the keyframes of the map");
  visit("min_inliers", min_inliers, "map points that a pose must rest on");
  visit("recovery_s", recovery_s, "time for which a lost pose is searched for before a new start");
  visit("seed", seed, "seed of RANSAC");
}

void TrackerOptions::Validate() const {
  if (mode != "sequential" && mode != "live") {
    throw UsageError(ErrorParts{.what = "invalid option",
                                .where = "tracking.mode",
                                .expected = "\"sequential\" or \"live\"",
                                .found = mode});
  }
  const auto require = [](bool holds, const char* option, const char* expected, double found) {
    RequireOption(holds, std::string("tracking.") + option, expected, found);
  };
  const auto at_least = [&](const char* option, const char* expected, double found, double least) {
    require(found >= least, option, expected, found);
  };
  const auto share = [&](const char* option, double found) {
    require(found > 0 && found <= 1, option, "more than 0, at most 1", found);
  };
  at_least("max_side_px", "64 or more", max_side_px, 64);
  at_least("features.num_features", "100 or more", features.num_features, 100);
  at_least("features.num_levels", "1 or more", features.num_levels, 1);
  require(features.scale_factor > 1 && features.scale_factor <= 2, "features.scale_factor",
          "more than 1, at most 2", features.scale_factor);
  require(features.patch_sigma_px > 0, "features.patch_sigma_px", "more than 0",
          features.patch_sigma_px);
  at_least("features.min_fast_threshold", "1 or more", features.min_fast_threshold, 1);
  at_least("features.fast_threshold", "min_fast_threshold or more", features.fast_threshold,
           features.min_fast_threshold);
  at_least("initialisation.min_matches", "8 or more", initialisation.min_matches, 8);
  at_least("initialisation.min_points", "8 or more", initialisation.min_points, 8);
  require(initialisation.min_parallax_deg > 0, "initialisation.min_parallax_deg", "more than 0",
          initialisation.min_parallax_deg);
  share("initialisation.search_radius_share", initialisation.search_radius_share);
  require(initialisation.max_wait_s > 0, "initialisation.max_wait_s", "more than 0",
          initialisation.max_wait_s);
  at_least("initialisation.max_kept_mb", "0 or more", initialisation.max_kept_mb, 0);
  require(insertion.max_rotation_deg > 0, "insertion.max_rotation_deg", "more than 0",
          insertion.max_rotation_deg);
  share("insertion.max_baseline_share", insertion.max_baseline_share);
  share("insertion.min_baseline_share", insertion.min_baseline_share);
  share("insertion.min_tracked_share", insertion.min_tracked_share);
  at_least("insertion.min_inliers", "4 or more", insertion.min_inliers, 4);
  at_least("mapping.num_neighbours", "1 or more", mapping.num_neighbours, 1);
  share("mapping.min_baseline_share", mapping.min_baseline_share);
  at_least("mapping.num_adjusted_keyframes", "3 or more", mapping.num_adjusted_keyframes, 3);
  at_least("mapping.num_fixed_keyframes", "0 or more", mapping.num_fixed_keyframes, 0);
  share("mapping.max_redundant_share", mapping.max_redundant_share);
  at_least("min_inliers", "10 or more", min_inliers, 10);
  at_least("recovery_s", "0 or more", recovery_s, 0);
}

}  // namespace mono3d
