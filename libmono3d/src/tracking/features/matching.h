// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tracking/features/descriptor.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// A map point and where an image should show it.
struct ProjectedPoint {
  PointId point;
  Eigen::Vector2d pixel;
  double radius_px = 0;
  int min_level = 0;
  int max_level = 0;
  Descriptor descriptor{};
  std::optional<double> angle_deg;  // of the patch where it was seen before
};

struct PointMatch {
  PointId point;
  std::size_t feature = 0;
  int distance = 0;  // Hamming
};

struct FeatureMatch {
  std::size_t feature_a = 0;
  std::size_t feature_b = 0;
};

struct MatchRule {
  int max_distance = kFarDistance;
  double max_ratio = 1;        // best over second best of the same level; 1: not looked at
  bool take_occupied = false;  // features that have a point already as well
};

// The most similar feature near each projected point; a feature goes to its most similar point.
// Where angles are known, matches whose patches turned otherwise than the most are dropped.
std::vector<PointMatch> MatchProjected(std::span<const ProjectedPoint> projected, const View& view,
                                       const MatchRule& rule);

// Where `view` should show a map point: nothing when it is behind the camera, outside the image,
// beyond the distances at which its patch can be told, or seen at more than 60 degrees from the
// directions known. The radius is that of the key point's level, wider when seen at a new angle.
std::optional<ProjectedPoint> ProjectMapPoint(const Map& map, PointId point, const View& view);

// Does a point show at the feature of the view but for the noise of that (chi2 at 95 %)?
bool ShowsAt(const CameraModel& camera, const View& view, const Eigen::Vector3d& p_cam,
             const Feature& feature);

// Pairs of features most similar to each other, second best worse by the ratio 0.8, turned alike.
// Only features of `a` for which `use_a` holds, of `b` for which `use_b` holds.
std::vector<FeatureMatch> MatchDescriptors(const View& a, const std::vector<char>& use_a,
                                           const View& b, const std::vector<char>& use_b);

// Where a feature is looked for in another image: on levels up to `max_level`, within `radius_px`
// (a square) of where it was, moved by `shift_px`.
struct Window {
  double radius_px = 0;
  int max_level = 0;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
};

// The same for two images a short time apart.
std::vector<FeatureMatch> MatchNearby(const View& a, const View& b, const Window& window);

}  // namespace mono3d::tracking
