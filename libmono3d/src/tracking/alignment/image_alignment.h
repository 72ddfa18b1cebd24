// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "tracking/alignment/octaves.h"

namespace mono3d::tracking {

// A point that image a shows.
struct SeenPoint {
  Eigen::Vector2d pixel_a;
  Eigen::Vector3d p_a;
};

// The motion T_b_a under which the surroundings of all points look alike in both images: inverse
// compositional alignment of small patches, from coarse to fine, robust, with one contrast and one
// brightness for the whole image (sparse image alignment: Forster, Pizzoli, Scaramuzza 2014).
// `T_b_a`: the prediction, also what comes back where there is nothing to align.
Pose AlignImages(const CameraModel& camera, const Octaves& a, std::span<const SeenPoint> points,
                 const Octaves& b, const Pose& T_b_a);

}  // namespace mono3d::tracking
