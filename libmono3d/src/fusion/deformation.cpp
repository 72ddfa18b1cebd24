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

// The motion of the tracker's world around a view, told in the model's.
Similarity MotionInModel(const FusedView& view, const KeyframeCorrection& correction) {
  const double ratio = correction.scale / view.tracker_scale;
  const Similarity tracker_from_cam(ratio, correction.T_world_cam);
  const Similarity motion = tracker_from_cam * Similarity(1, view.T_tracker_cam).Inverse();
  const Similarity model_from_tracker =
      Similarity(view.depth_scale, view.T_world_cam) *
      Similarity(view.tracker_scale, view.T_tracker_cam).Inverse();
  return model_from_tracker * motion * model_from_tracker.Inverse();
}

// The same where the model has the view moved away from the tracker's pose, and is to let go of it.
Similarity MotionToTracker(const FusedView& view, const KeyframeCorrection& correction) {
  return Similarity(correction.scale, correction.T_world_cam) *
         Similarity(view.depth_scale, view.T_world_cam).Inverse();
}

const KeyframeCorrection* Find(std::span<const KeyframeCorrection> corrections,
                               std::int64_t keyframe_id) {
  const auto found = std::find_if(corrections.begin(), corrections.end(),
                                  [&](const auto& c) { return c.id == keyframe_id; });
  return found == corrections.end() ? nullptr : &*found;
}

// How far a motion takes what the view looks at from where another one takes it, over its depth.
double Apart(const FusedView& view, const Similarity& a, const Similarity& b) {
  return (a * Centre(view) - b * Centre(view)).norm() / view.median_depth_su;
}

// Views that the model had moved are expected to move as its oldest view does. Whether the
// tracker's new poses are nearer to that than to do both, its motion and the model's.
bool TrackerComesRound(const std::vector<FusedView>& views,
                       std::span<const KeyframeCorrection> corrections) {
  if (views.empty()) return false;
  const KeyframeCorrection* of_first = Find(corrections, views.front().keyframe_id);
  const Similarity expected =
      of_first == nullptr ? Similarity() : MotionInModel(views.front(), *of_first);
  double to_tracker = 0;
  double both = 0;
  for (const FusedView& view : views) {
    const KeyframeCorrection* correction = Find(corrections, view.keyframe_id);
    if (correction == nullptr || view.is_break) continue;
    // Where the model has the view as the tracker does, the two are equal.
    to_tracker += Apart(view, expected, MotionToTracker(view, *correction));
    both += Apart(view, expected, MotionInModel(view, *correction));
  }
  return to_tracker < both;
}

std::optional<Similarity> MoveView(FusedView& view, std::span<const KeyframeCorrection> corrections,
                                   bool to_tracker) {
  const KeyframeCorrection* found = Find(corrections, view.keyframe_id);
  if (found == nullptr) return std::nullopt;
  const Similarity motion =
      to_tracker ? MotionToTracker(view, *found) : MotionInModel(view, *found);
  view.T_tracker_cam = found->T_world_cam;
  view.tracker_scale = found->scale;
  return motion;
}

// How far two motions take a point apart, in pixels of `view`.
double Apart_px(const FusedView& view, const Vector3d& point_world, const Similarity& a,
                const Similarity& b) {
  const Vector3d before = a.Inverse() * point_world;
  return view.camera.fx * (b * before - point_world).norm() / view.median_depth_su;
}

}  // namespace

Vector3d Centre(const FusedView& view) {
  return view.T_world_cam * Vector3d(0, 0, view.median_depth_su);
}

bool Sees(const FusedView& view, const Vector3d& point_world) {
  const Vector3d p = view.T_world_cam.Inverse() * point_world;
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

std::vector<Similarity> MoveViews(std::vector<FusedView>& views,
                                  std::span<const KeyframeCorrection> corrections) {
  std::vector<std::optional<Similarity>> known;
  const bool to_tracker = TrackerComesRound(views, corrections);
  for (FusedView& view : views) known.push_back(MoveView(view, corrections, to_tracker));
  const auto first = std::find_if(known.begin(), known.end(), [](const auto& m) { return !!m; });
  if (first == known.end()) return {};
  std::vector<Similarity> motions;
  Similarity latest = **first;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (known[i]) latest = *known[i];
    motions.push_back(latest);
    FusedView& view = views[i];
    view.T_world_cam = latest * view.T_world_cam;
    view.depth_scale *= latest.scale();
    view.median_depth_su *= latest.scale();
    if (known[i]) continue;
    view.T_tracker_cam = to_tracker ? view.T_world_cam : latest * view.T_tracker_cam;
    view.tracker_scale = to_tracker ? view.depth_scale : view.tracker_scale * latest.scale();
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
