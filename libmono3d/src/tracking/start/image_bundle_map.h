// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/tracking/image_bundle_poses.h"
#include "tracking/map/map.h"
#include "tracking/start/two_view_start.h"

namespace mono3d::tracking {

// Two of the views of a bundle, and a motion between them.
struct ImageBundleStart {
  std::size_t a = 0;
  std::size_t b = 0;
  TwoViewStart motion;
};

// The map that grows from a start.
struct ImageBundleMap {
  std::unique_ptr<Map> map;
  std::vector<KeyframeId> keyframe_of_view;  // empty when one could not be added
  std::string reason;                        // why not
  double score = 0;  // what all observations together say for the map, see ScoreOf

  bool IsComplete() const { return !keyframe_of_view.empty(); }
};

// Adds, one after the other, the view that sees most of the map by then; new points and bundle
// adjustment after each. Views have features, grid and octaves.
ImageBundleMap GrowMap(const std::vector<View>& views, const ImageBundleStart& start,
                       const ImageBundlePosesOptions& options);

// Sum over all observations of 5.991 minus the squared error over its variance, less 5.991 * 1.5
// for each point, whose three coordinates fit the noise of so many observations: comparable over
// maps of the same views.
double ScoreOf(const Map& map);

// Looks for every point, by its patch, in all keyframes that do not see it yet.
void ExtendTracks(Map& map);

}  // namespace mono3d::tracking
