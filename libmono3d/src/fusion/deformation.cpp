// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/deformation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

namespace mono3d {
namespace {

using Eigen::Vector3d;

// Where the tracker has the keyframe of a view now; nothing where it does not know.
const Similarity* Find(const KeyframePoses& poses, int map_id, const FusedView& view) {
  const KeyframePose* found = poses.Find(view.keyframe_id);
  return found == nullptr || found->map_id != map_id ? nullptr : &found->S_world_kf;
}

// The motion of the tracker's world around a view.
Similarity MotionOfTracker(const FusedView& view, const Similarity& S_tracker_kf) {
  return S_tracker_kf * view.S_tracker_kf.Inverse();
}

// What takes a view that the model has moved away from the tracker's pose back to it.
Similarity MotionToTracker(const FusedView& view, const Similarity& S_tracker_kf) {
  return S_tracker_kf * view.S_world_kf.Inverse();
}

// In the unit of the world.
double MedianDepthInWorld(const FusedView& view) {
  return view.S_world_kf.scale() * view.median_depth_su;
}

bool MovesNoticeably(const FusedView& view, const Similarity& motion) {
  const double limit = kMinMotion_px * MedianDepthInWorld(view) / view.camera.fx;
  const auto places = Places(view);
  return std::any_of(places.begin(), places.end(),
                     [&](const Vector3d& p) { return (motion * p - p).norm() >= limit; });
}

// How far a motion takes what the view looks at from where another one takes it, over its depth.
double Apart(const FusedView& view, const Similarity& a, const Similarity& b) {
  return (a * Centre(view) - b * Centre(view)).norm() / MedianDepthInWorld(view);
}

// Views that the model had moved are expected to move as its oldest view does. Whether the
// tracker's new poses are nearer to that than to do both, its motion and the model's.
bool TrackerConverged(const std::vector<FusedView>& views, const KeyframePoses& poses, int map_id) {
  if (views.empty()) return false;
  const Similarity* of_first = Find(poses, map_id, views.front());
  const Similarity expected =
      of_first == nullptr ? Similarity() : MotionOfTracker(views.front(), *of_first);
  double to_tracker = 0;
  double both = 0;
  for (const FusedView& view : views) {
    const Similarity* found = Find(poses, map_id, view);
    if (found == nullptr || view.is_break) continue;
    // Where the model has the view as the tracker does, the two are equal.
    to_tracker += Apart(view, expected, MotionToTracker(view, *found));
    both += Apart(view, expected, MotionOfTracker(view, *found));
  }
  return to_tracker < both;
}

// How far two motions take a point apart, in pixels of `view`.
double Apart_px(const FusedView& view, const Vector3d& point_world, const Similarity& a,
                const Similarity& b) {
  const Vector3d before = a.Inverse() * point_world;
  return view.camera.fx * (b * before - point_world).norm() / MedianDepthInWorld(view);
}

}  // namespace

Vector3d Centre(const FusedView& view) {
  return view.S_world_kf * Vector3d(0, 0, view.median_depth_su);
}

std::array<Vector3d, 9> Places(const FusedView& view) {
  std::array<Vector3d, 9> places;
  std::size_t i = 0;
  for (const double row : {0.1, 0.5, 0.9}) {
    for (const double column : {0.1, 0.5, 0.9}) {
      const Eigen::Vector2d pixel(column * view.camera.width, row * view.camera.height);
      places.at(i++) =
          view.S_world_kf * Vector3d(view.median_depth_su * view.camera.Unproject(pixel));
    }
  }
  return places;
}

bool Sees(const FusedView& view, const Vector3d& point_world) {
  const Vector3d p = view.S_world_kf.Inverse() * point_world;
  if (p.z() <= 0) return false;
  const double u = view.camera.fx * p.x() / p.z() + view.camera.cx;
  const double v = view.camera.fy * p.y() / p.z() + view.camera.cy;
  return u >= 0 && v >= 0 && u < view.camera.width && v < view.camera.height;
}

std::vector<std::size_t> Evenly(const std::vector<std::size_t>& numbers, std::size_t max_count) {
  if (numbers.size() <= max_count) return numbers;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < max_count; ++i) {
    chosen.push_back(numbers[i * (numbers.size() - 1) / std::max<std::size_t>(max_count - 1, 1)]);
  }
  return chosen;
}

std::vector<Similarity> MoveViews(std::vector<FusedView>& views, const KeyframePoses& poses,
                                  int map_id) {
  const bool has_moved = std::any_of(views.begin(), views.end(), [&](const FusedView& view) {
    const Similarity* found = Find(poses, map_id, view);
    return found != nullptr && MovesNoticeably(view, MotionOfTracker(view, *found));
  });
  if (!has_moved) return {};
  const bool to_tracker = TrackerConverged(views, poses, map_id);
  std::vector<std::optional<Similarity>> known;
  for (FusedView& view : views) {
    const Similarity* found = Find(poses, map_id, view);
    known.emplace_back();
    if (found == nullptr) continue;
    known.back() = to_tracker ? MotionToTracker(view, *found) : MotionOfTracker(view, *found);
    view.S_tracker_kf = *found;
  }
  const auto first = std::find_if(known.begin(), known.end(), [](const auto& m) { return !!m; });
  std::vector<Similarity> motions;
  Similarity latest = **first;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (known[i]) latest = *known[i];
    motions.push_back(latest);
    FusedView& view = views[i];
    view.S_world_kf = latest * view.S_world_kf;
    if (known[i]) continue;
    view.S_tracker_kf = to_tracker ? view.S_world_kf : latest * view.S_tracker_kf;
  }
  return motions;
}

std::vector<DeformationNode> MakeNodes(std::span<const FusedView> views,
                                       std::span<const Similarity> motions) {
  std::vector<DeformationNode> nodes;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Vector3d after = Centre(views[i]);
    const Vector3d before = motions[i].Inverse() * after;
    const Eigen::Matrix3d R = motions[i].scale() * motions[i].pose().rotation().toRotationMatrix();
    DeformationNode node{};
    for (int row = 0; row < 3; ++row) {
      const auto at = static_cast<std::size_t>(row);
      for (int col = 0; col < 3; ++col) {
        node.at(4 * at + static_cast<std::size_t>(col)) = static_cast<float>(R(row, col));
      }
      node.at(4 * at + 3) = static_cast<float>(after(row));
      node.at(12 + at) = static_cast<float>(before(row));
    }
    node[15] = static_cast<float>(motions[i].scale());
    nodes.push_back(node);
  }
  return nodes;
}

std::vector<std::size_t> ViewsOfOverlap(std::span<const FusedView> views,
                                        std::span<const Similarity> motions,
                                        std::size_t max_views) {
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t k = 0; k < views.size(); ++k) {
      const std::size_t gap = i > k ? i - k : k - i;
      if (gap <= kDeformationWindow) continue;
      const Vector3d centre = Centre(views[k]);
      if (!Sees(views[i], centre)) continue;
      if (Apart_px(views[i], centre, motions[k], motions[i]) < 1) continue;
      candidates.push_back(i);
      break;
    }
  }
  return Evenly(candidates, max_views);
}

}  // namespace mono3d
