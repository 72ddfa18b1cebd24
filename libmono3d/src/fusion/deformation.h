// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// A depth map of the model.
struct FusedView {
  std::int64_t keyframe_id = 0;
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  CameraModel camera;
  Similarity S_tracker_kf;     // S_world_kf of the tracker's poses to which it was brought last
  Similarity S_world_kf;       // where the model has it
  double median_depth_su = 0;  // in the own unit of its keyframe
  int submap = 0;              // the part of the model to which it belongs
  bool is_break = false;  // repeats another view, see BreakBetween; no surfel is anchored to it
};

// How one view moves, as shaders/fusion/deform.comp reads it: three rows of [scale * rotation |
// centre afterwards], then centre before and scale. The centre is what the view looks at.
using DeformationNode = std::array<float, 16>;

// A surfel follows the views so many before and after its anchor.
inline constexpr std::uint32_t kDeformationWindow = 3;

// A fifth of the half pixel of noise that a depth map's matching has: less shows nowhere.
inline constexpr double kMinMotion_px = 0.1;

// What the view looks at, in the world.
Eigen::Vector3d Centre(const FusedView& view);
// Places at which the view looks, in the world: near its corners, its sides, its middle.
std::array<Eigen::Vector3d, 9> Places(const FusedView& view);
// Whether the view has a point in its image, whatever stands before it.
bool Sees(const FusedView& view, const Eigen::Vector3d& point_world);
// At most `max_count` of the numbers, evenly among them, the first and the last among these.
std::vector<std::size_t> Evenly(const std::vector<std::size_t>& numbers, std::size_t max_count);

// Brings the views to the tracker's poses of now, those of map `map_id`, and returns how each has
// moved in the world. Empty, with the views as they were, where none has moved noticeably: by
// kMinMotion_px of its image. A view whose keyframe is not among the poses moves with the nearest
// one before it that is, else after it.
// Where the model had moved views away from the tracker's poses, they keep that motion, unless the
// tracker has converged to it: then its new poses are theirs, or it would be done twice.
std::vector<Similarity> MoveViews(std::vector<FusedView>& views, const KeyframePoses& poses,
                                  int map_id);

// `views` as they are after MoveViews, which returned `motions`.
std::vector<DeformationNode> MakeNodes(std::span<const FusedView> views,
                                       std::span<const Similarity> motions);

// The views from which to look for parts of the model that have moved against each other by a pixel
// or more: at most `max_views`, evenly among those that see such parts.
std::vector<std::size_t> ViewsOfOverlap(std::span<const FusedView> views,
                                        std::span<const Similarity> motions, std::size_t max_views);

}  // namespace mono3d
