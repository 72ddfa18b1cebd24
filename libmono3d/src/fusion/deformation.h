// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe_correction.h"

namespace mono3d {

// A depth map of the model.
struct FusedView {
  std::int64_t keyframe_id = 0;
  std::int64_t frame_index = 0;
  CameraModel camera;
  Pose T_tracker_cam;          // as the tracker has it
  double tracker_scale = 1;    // the scale of its last correction
  Pose T_world_cam;            // in the model
  double depth_scale = 1;      // by which its depths have been multiplied
  double median_depth_su = 0;  // in the model
};

// How one view moves, as shaders/fusion/deform.comp reads it: three rows of [scale * rotation |
// centre afterwards], then centre before and scale. The centre is what the view looks at.
using DeformationNode = std::array<float, 16>;

// A surfel follows the views so many before and after its anchor.
inline constexpr std::uint32_t kDeformationWindow = 3;

// Moves the views, and returns how each has moved in the model's world. A view without a correction
// moves with the nearest one before it that has one, else after it. Empty when there is none.
std::vector<Similarity> MoveViews(std::vector<FusedView>& views,
                                  std::span<const KeyframeCorrection> corrections);

// `views` as they are after MoveViews, which returned `motions`.
std::vector<DeformationNode> MakeNodes(std::span<const FusedView> views,
                                       std::span<const Similarity> motions);

// The views from which to look for parts of the model that have moved against each other by a pixel
// or more: at most `max_views`, evenly among those that see such parts.
std::vector<std::size_t> ViewsOfOverlap(std::span<const FusedView> views,
                                        std::span<const Similarity> motions, std::size_t max_views);

}  // namespace mono3d
