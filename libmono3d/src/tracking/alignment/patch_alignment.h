// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "tracking/alignment/octaves.h"
#include "tracking/alignment/patch_normal.h"

namespace mono3d::tracking {

// What a map point looks like: the grey values around it in one octave of one image, and how its
// surface lies.
struct Patch {
  static constexpr int kRadius = 10;  // holds the 9 x 9 px, and their gradients, at twice the size
  static constexpr int kSide = 2 * kRadius + 1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // where it was taken, px of the full image
  int octave = 0;
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();  // of the point, in columns and rows of `grey`
  std::array<std::uint8_t, kSide * kSide> grey{};
  PatchNormal normal;  // at `pixel`
};

// Nothing where the square would leave the image. Of the normal nothing is known yet.
std::optional<Patch> TakePatch(const Octaves& octaves, const Eigen::Vector2d& pixel, int octave);

// How a small plane in camera a looks in camera b.
struct PatchWarp {
  Eigen::Matrix2d by_pixel;   // d pixel in camera b / d pixel in camera a
  Eigen::Vector2d by_normal;  // with the normal, by_pixel changes by by_normal * change^T
};

// Of a plane at depth `z_a` of that normal. Nothing when the point is behind camera b.
std::optional<PatchWarp> WarpPatch(const CameraModel& camera, const Pose& T_b_a,
                                   const Eigen::Vector2d& pixel_a, double z_a,
                                   const Eigen::Vector2d& normal);

// Where a patch was found.
struct PatchPosition {
  Eigen::Vector2d pixel;   // px of the full image
  int octave = 0;          // that it was aligned on
  double correlation = 0;  // of the grey values there with the patch, -1 to 1
  // Standard deviation in x and in y by the noise of the grey values, px of the full image: from
  // what remains of their difference, and from how steep they are.
  double sigma_px = 0;
};

// Finds the patch near `start_px`: inverse compositional alignment (Baker and Matthews 2004) of
// 9 x 9 pixels over translation, brightness and contrast, on the octave on which `warp` makes the
// patch neither finer nor coarser. Nothing when the patch has no texture in some direction, leaves
// the image, goes further than `max_move` px of that octave, or does not converge.
std::optional<PatchPosition> AlignPatch(const Patch& patch, const Eigen::Matrix2d& warp,
                                        const Octaves& octaves, const Eigen::Vector2d& start_px,
                                        double max_move = 4);

// What one image says of a normal, ready to be added up.
struct NormalEvidence {
  Eigen::Matrix2d information;
  Eigen::Vector2d weighted_normal;  // information * normal
};

// From the image in which the patch of that warp, with the normal that the patch has now, was found
// at `at_px`: the place, the brightness and the contrast may be off too. Nothing where the patch
// has too little texture or leaves the image.
std::optional<NormalEvidence> MeasureNormal(const Patch& patch, const PatchWarp& warp,
                                            const Octaves& octaves, const Eigen::Vector2d& at_px);

}  // namespace mono3d::tracking
