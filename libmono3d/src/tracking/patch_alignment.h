// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "tracking/octaves.h"

namespace mono3d::tracking {

// What a map point looks like: the grey values around it in one octave of one image.
struct Patch {
  static constexpr int kRadius = 10;
  static constexpr int kSide = 2 * kRadius + 1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // where it was taken, px of the full image
  int octave = 0;
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();  // of the point, in columns and rows of `grey`
  std::array<std::uint8_t, kSide * kSide> grey{};
};

// Nothing where the square would leave the image.
std::optional<Patch> TakePatch(const Octaves& octaves, const Eigen::Vector2d& pixel, int octave);

// d pixel in camera b / d pixel in camera a of a small plane at depth `z_a` that faces camera a.
// Nothing when the point is behind camera b.
std::optional<Eigen::Matrix2d> PatchWarp(const CameraModel& camera, const Pose& T_b_a,
                                         const Eigen::Vector2d& pixel_a, double z_a);

// Where a patch was found.
struct PatchPosition {
  Eigen::Vector2d pixel;   // px of the full image
  int octave = 0;          // that it was aligned on
  double correlation = 0;  // of the grey values there with the patch, -1 to 1
};

// Finds the patch near `start_px`: inverse compositional alignment (Baker and Matthews 2004) of
// 9 x 9 pixels over translation, brightness and contrast, on the octave on which `warp` makes the
// patch neither finer nor coarser. Nothing when the patch has no texture in some direction, leaves
// the image, goes further than `max_move` px of that octave, or does not settle.
std::optional<PatchPosition> AlignPatch(const Patch& patch, const Eigen::Matrix2d& warp,
                                        const Octaves& octaves, const Eigen::Vector2d& start_px,
                                        double max_move = 4);

}  // namespace mono3d::tracking
