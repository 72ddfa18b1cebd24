// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/geometry/point_cloud.h"

namespace mono3d::tools {

// A parallel projection: a point is at pixel (x, y) = size / 2 + R_view_world * (p - centre) /
// pixel_su.
struct CloudView {
  std::string name;  // "from above"
  Eigen::Matrix3d R_view_world =
      Eigen::Matrix3d::Identity();                         // x right, y down, z away from viewer
  Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();  // in the middle of the picture
  double pixel_su = 1;                                     // side of a pixel in the world
  cv::Size size = {960, 720};
};

// Three views that show all but the outermost 1 % of the points: from above and, 35 degrees above
// the horizon, from two sides a quarter turn apart. `up_world` is where up is; without it up is the
// cloud's smallest principal axis, on the side its normals point to, or, without normals, on the
// side it sticks out to. Pictures are as wide as `width_px` and as high as the cloud needs, at most
// as wide. Throws Error when the cloud is empty or not finite.
std::vector<CloudView> StandardCloudViews(const PointCloud& cloud, int width_px = 960,
                                          const std::optional<Eigen::Vector3d>& up_world = {});

}  // namespace mono3d::tools
