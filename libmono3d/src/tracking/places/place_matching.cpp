// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/place_matching.h"

#include <algorithm>
#include <cmath>

#include "mono3d/core/statistics.h"
#include "tracking/alignment/patch_tracking.h"
#include "tracking/features/feature_tracking.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/places/relocaliser.h"

namespace mono3d::tracking {
namespace {

// Of old points that hold the pose: a wrong place joins what has nothing in common, and cannot be
// undone.
constexpr int kMinPlaceInliers = 50;
// Of points that both sides have, for the scale: it is sure to one or two percent.
constexpr std::size_t kMinPairs = 20;

// A point of the keyframe, an old one at the same pixel, and the ratio of their depths.
struct PointsAtPixel {
  PointId own;
  PointId old;
  double log_ratio = 0;
  bool is_same = false;  // pixel, within their standard deviations
};

std::vector<PointsAtPixel> PairsOf(const Map& own_map, const View& own, const Map& old_map,
                                   const View& old) {
  constexpr double kSamePixel = 2;  // px
  std::vector<PointsAtPixel> pairs;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < old.points.size(); ++i) {
    if (!old.points[i] || old_map.point(*old.points[i]).depth_sigma > 0) continue;
    const Eigen::Vector2d& pixel = old.features[i].pixel;
    found.clear();
    own.grid.Find(pixel, kSamePixel, 0, own_map.scales().num_levels(), found);
    std::optional<std::size_t> nearest;
    for (const std::size_t k : found) {
      if (!own.points[k]) continue;
      if (&own_map == &old_map && own.points[k] == old.points[i]) continue;
      const auto distance = [&](std::size_t of) {
        return (own.features[of].pixel - pixel).squaredNorm();
      };
      if (!nearest || distance(k) < distance(*nearest)) nearest = k;
    }
    if (!nearest) continue;
    if (own_map.point(*own.points[*nearest]).depth_sigma > 0) continue;
    const double z_own = (own.T_cam_world * own_map.point(*own.points[*nearest]).p_world).z();
    const double z_old = (old.T_cam_world * old_map.point(*old.points[i]).p_world).z();
    if (z_own <= 0 || z_old <= 0) continue;
    const Feature& a = own.features[*nearest];
    const Feature& b = old.features[i];
    const bool is_same = (a.pixel - b.pixel).squaredNorm() <=
                         kChi2TwoDof * (a.sigma_px * a.sigma_px + b.sigma_px * b.sigma_px);
    pairs.push_back({*own.points[*nearest], *old.points[i], std::log(z_old / z_own), is_same});
  }
  return pairs;
}

// The scale that most pairs agree on; leaves only those that do. Nothing when they are too few.
std::optional<double> CommonScale(std::vector<PointsAtPixel>& pairs) {
  if (pairs.size() < kMinPairs) return std::nullopt;
  std::vector<double> ratios;
  for (const PointsAtPixel& pair : pairs) ratios.push_back(pair.log_ratio);
  const double median = UpperMedian(std::move(ratios));
  constexpr double kTolerance = 0.05;  // of the depth: noise of points seen under little parallax
  std::erase_if(pairs, [&](const PointsAtPixel& pair) {
    return std::abs(pair.log_ratio - median) > kTolerance;
  });
  if (pairs.size() < kMinPairs) return std::nullopt;
  double sum = 0;
  for (const PointsAtPixel& pair : pairs) sum += pair.log_ratio;
  return std::exp(sum / static_cast<double>(pairs.size()));
}

}  // namespace

std::optional<PlaceFound> MatchPlace(const Map& own_map, KeyframeId keyframe, Map& old_map,
                                     KeyframeId old_keyframe, int seed) {
  const View own = own_map.keyframe(keyframe).view;
  View found = own;
  found.shutter = own.shutter.WithoutLinear();  // whose unit is that of another world
  // Its points are numbers of another map; where too few match, none are put in their place.
  std::fill(found.points.begin(), found.points.end(), std::nullopt);
  if (FindPoseByKeyframe(old_map, old_keyframe, found, seed).num_inliers == 0) return std::nullopt;
  static_cast<void>(TrackLocalMap(old_map, found));
  View old = found;
  const PoseResult result = TrackPatches(old_map, found, old);
  if (result.num_inliers < kMinPlaceInliers) return std::nullopt;
  std::vector<PointsAtPixel> pairs = PairsOf(own_map, own, old_map, old);
  const std::optional<double> scale = CommonScale(pairs);
  if (!scale) return std::nullopt;
  PlaceFound place{keyframe, old_keyframe, old.T_cam_world, *scale, result.num_inliers, {}};
  for (const PointsAtPixel& pair : pairs) {
    if (pair.is_same) place.same.emplace_back(pair.own, pair.old);
  }
  return place;
}

}  // namespace mono3d::tracking
