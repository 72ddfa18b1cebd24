// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

// Why a place is worth being seen again.
enum class ViewNeed {
  kHidden,     // in every image that looks there, something else stands before it
  kUncertain,  // it is inferred, or of low confidence
  kThin,       // one depth map alone saw it
  kGrazing,    // it was seen at a flat angle alone
  kOneSided,   // it was seen from one direction alone
};
const char* ToString(ViewNeed need);     // "hidden", "uncertain", "thin", "grazing", "one_sided"
const char* Explanation(ViewNeed need);  // "hidden behind what was seen"

// A place to fly by and where to look from there.
struct NextView {
  Pose T_world_cam;  // level
  Eigen::Vector3d target_world = Eigen::Vector3d::Zero();
  std::map<ViewNeed, double> gain_su2;  // area that it shows better, beside the views before it
  double Gain() const;
  ViewNeed MainNeed() const;
};

struct NextViews {
  std::vector<NextView> views;  // the best first; what is hidden counts more than what is weak
  double distance_su = 0;       // of a view from its target: that of the flight, in the middle
  double cell_su = 0;           // places are cells of a grid with this edge
  double surface_su2 = 0;       // of the model
  std::map<ViewNeed, double> area_su2 = {};  // that needs to be seen again
};

struct NextViewsOptions {
  int max_views = 12;
  // Of what an image covers at the distance of the flight, of hidden places; of weak ones more.
  double min_gain = 0.03;
};

// Where the camera should fly next, so that the model gains most. The model and what the depth maps
// in it saw, saw through and could not see are looked at in cells, of which an image shows 64 in a
// row. Proposed are views from as far away as those of the flight, at heights of the flight, which
// see enough of what is known to be tracked; each gains with those before it flown. What no image
// looked at at all is not asked for: a flight ends somewhere. Obstacles that the model does not
// show are not known. No views for a map without a model.
NextViews ProposeNextViews(const MapReconstruction& map, const NextViewsOptions& options = {});

}  // namespace mono3d
