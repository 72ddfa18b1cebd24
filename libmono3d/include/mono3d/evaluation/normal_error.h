// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/evaluation/error_statistics.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

struct TrueNormalOptions {
  int radius_px = 2;  // of the square window that a plane is fitted to
  // Largest distance of a point of the window from the plane, in footprints of a pixel (z / f).
  double max_plane_distance_footprints = 0.5;
};

// The normals of a true depth map (CV_32FC1, 0: none), where it is locally a plane: CV_32FC3, unit
// length, camera frame, towards the camera (n_z < 0 at the image centre); 0 where the window
// leaves the image, lacks a depth, or its points do not lie on one plane: at depth edges,
// roughness and curvature there is no normal to be held to. The plane is the least-squares fit to
// inverse depth, which is linear in the pixel on a plane.
// Throws Error when size or type are off.
cv::Mat NormalsFromDepth(const cv::Mat& depth, const CameraModel& camera,
                         const TrueNormalOptions& options = {});

// The pixels whose surface is seen at a slant: where the angle between the normal and the way to
// the camera is more than `min_angle_deg`, 0 to 90. CV_8UC1, 255 there and 0 elsewhere, as where
// there is no normal. Throws Error when the normals are not CV_32FC3 of the camera's size.
cv::Mat SlantedSurfaces(const cv::Mat& normals, const CameraModel& camera, double min_angle_deg);

// Angles between estimated and true normals, over the pixels that have both.
struct NormalError {
  std::int64_t num_true_pixels = 0;  // with a true normal
  std::int64_t num_pixels = 0;       // of them: with an estimate
  double density = 0;                // num_pixels / num_true_pixels
  ErrorStatistics angle_deg;
  // Shares of the pixels below the angles in use since Fouhey et al. 2013.
  double share_below_11_25_deg = 0;
  double share_below_22_5_deg = 0;
  double share_below_30_deg = 0;
};

// Both CV_32FC3 of one size; length 0: no normal. Others need not be of unit length. Throws Error
// when type or size differ.
NormalError CompareNormals(const cv::Mat& estimate, const cv::Mat& truth);

// The figures of many maps: means over the maps that have pixels; the counts are sums and
// angle_deg.min and .max are over all of them. Density is the mean over maps with a true normal.
NormalError MeanNormalError(std::span<const NormalError> errors);

}  // namespace mono3d
