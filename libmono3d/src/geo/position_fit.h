// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geo/position_noise.h"
#include "geo/position_pairs.h"
#include "mono3d/geo/georeference.h"

namespace mono3d {

// The similarity from a map to east, north, up, and the clock offset. Increments: see
// Georeference::covariance.
struct MapPlacement {
  Eigen::Vector3d centre_map = Eigen::Vector3d::Zero();  // of the cameras
  Eigen::Vector3d p_enu_m = Eigen::Vector3d::Zero();     // where it is
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double scale = 1;
  double clock_offset_s = 0;

  using Increment = Eigen::Matrix<double, 8, 1>;
  void Add(const Increment& increment);
  Eigen::Vector3d operator*(const Eigen::Vector3d& p_map) const {
    return rotation * (scale * (p_map - centre_map)) + p_enu_m;
  }
  Similarity ToSimilarity() const;
};

// What the fit of a placement knows beside the positions.
struct PlacementPriors {
  std::optional<UpDirection> up;
  double clock_offset_s = 0;
  double clock_offset_sigma_s = 0;                      // 0: the offset is held
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();  // in camera axes
  // Standard deviations that receivers of this kind have, and how many independent errors that
  // knowledge is worth.
  double horizontal_m = 0;
  double vertical_m = 0;
  double worth = 2;
  bool has_vertical = true;
};

// Weighted least squares over the sums of distances (iteratively reweighted): robust against single
// fixes that are far off. Where the cameras are on a line the rotation about it is arbitrary.
MapPlacement FitRobustly(const std::vector<PositionPair>& pairs, double typical_m);

// The placement, turned about the direction in which the cameras spread most so that `up_map`
// points up as far as that goes: of cameras along a line that is the roll, of others it changes
// little. Where it would put the pairs farther apart, beyond what they err by anyway, nothing is
// turned.
MapPlacement RolledUpright(const std::vector<PositionPair>& pairs, const MapPlacement& placement,
                           const Eigen::Vector3d& up_map, double typical_m, bool has_vertical);

// Mean distance between fixes and cameras of a placement.
double MeanDistance(const std::vector<PositionPair>& pairs, const MapPlacement& placement,
                    bool has_vertical);

// Fixes minus cameras.
std::vector<Eigen::Vector3d> ResidualsOf(const std::vector<PositionPair>& pairs,
                                         const MapPlacement& placement,
                                         const Eigen::Vector3d& antenna_m);

struct PlacementFit {
  MapPlacement::Increment increment;       // the mean over the noises that are likely
  Eigen::Matrix<double, 8, 8> covariance;  // the same, with what their fits differ by
  PositionNoise horizontal, vertical;      // the most likely ones
};

// One step of least squares at `placement`, averaged over the likely noises. Nothing where the
// positions and priors do not determine all increments.
std::optional<PlacementFit> FitStep(const std::vector<PositionPair>& pairs,
                                    const std::vector<bool>& is_used, const MapPlacement& placement,
                                    const PlacementPriors& priors);

// The squared residuals of the fit that is best, one step from `placement`, each over its variance
// and with errors that wander taken as such, less what is expected of so many: a fix that has no
// camera at this clock offset is as good as one that fits as well as its errors allow. Of two
// placements that of the smaller one is the more likely, by half of the difference (logarithm).
// Nothing where the fit is not determined.
std::optional<double> ExcessOfFit(const std::vector<PositionPair>& pairs,
                                  const std::vector<bool>& is_used, const MapPlacement& placement,
                                  const PlacementPriors& priors, const PositionNoise& horizontal,
                                  const PositionNoise& vertical);

}  // namespace mono3d
