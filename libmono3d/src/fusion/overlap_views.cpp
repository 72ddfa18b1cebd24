// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/overlap_views.h"

#include <algorithm>
#include <array>

namespace mono3d {
namespace {

// How far two motions take a point apart, in pixels of `view`. The point is where the first one has
// taken it.
double MotionApart_px(const PlacedAnchor& view, const Eigen::Vector3d& point_world,
                      const Similarity& a, const Similarity& b) {
  const Eigen::Vector3d before = a.Inverse() * point_world;
  return view.anchor.camera.fx * (b * before - point_world).norm() / view.median_depth();
}

}  // namespace

std::vector<std::uint32_t> Evenly(const std::vector<std::uint32_t>& numbers,
                                  std::size_t max_count) {
  if (numbers.size() <= max_count) return numbers;
  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < max_count; ++i) {
    chosen.push_back(numbers[i * (numbers.size() - 1) / std::max<std::size_t>(max_count - 1, 1)]);
  }
  return chosen;
}

std::vector<std::uint32_t> ViewsOfOverlap(const AnchorMap& anchors,
                                          std::span<const Similarity> S_world_kf_before) {
  const auto num_anchors = static_cast<std::uint32_t>(S_world_kf_before.size());
  std::vector<Similarity> motions;
  std::vector<Eigen::Vector3d> centres;
  bool has_bent = false;
  for (std::uint32_t i = 0; i < num_anchors; ++i) {
    motions.push_back(anchors.S_world_kf()[i] * S_world_kf_before[i].Inverse());
    centres.push_back(Centre(anchors.Placed(i)));
    // Two that have moved by less than half a pixel against the first are less than one apart.
    has_bent = has_bent ||
               MotionApart_px(anchors.Placed(i), centres[i], motions[i], motions.front()) >= 0.5;
  }
  std::vector<std::uint32_t> views;
  for (std::uint32_t i = 0; has_bent && i < num_anchors; ++i) {
    const PlacedAnchor view = anchors.Placed(i);
    for (std::uint32_t k = 0; k < num_anchors; ++k) {
      if (anchors.AreOnePart(i, k) ||
          MotionApart_px(view, centres[k], motions[k], motions[i]) < 1 || !Sees(view, centres[k])) {
        continue;
      }
      views.push_back(i);
      break;
    }
  }
  return views;
}

std::vector<std::uint32_t> ViewsAcross(const AnchorMap& anchors,
                                       const std::vector<bool>& is_other) {
  std::vector<std::array<Eigen::Vector3d, 9>> places;
  for (std::uint32_t i = 0; i < anchors.size(); ++i) places.push_back(Places(anchors.Placed(i)));
  std::vector<std::uint32_t> views;
  for (std::uint32_t i = 0; i < anchors.size(); ++i) {
    const PlacedAnchor view = anchors.Placed(i);
    for (std::uint32_t k = 0; k < anchors.size(); ++k) {
      const bool sees_other =
          is_other[i] != is_other[k] &&
          std::any_of(places[k].begin(), places[k].end(),
                      [&](const Eigen::Vector3d& place) { return Sees(view, place); });
      if (!sees_other) continue;
      views.push_back(i);
      break;
    }
  }
  return views;
}

}  // namespace mono3d
