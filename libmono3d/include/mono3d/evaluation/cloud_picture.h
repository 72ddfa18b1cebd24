// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mono3d/geometry/point_cloud.h"

namespace mono3d {

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

// A cloud to draw and how.
struct CloudLayer {
  const PointCloud* cloud = nullptr;  // not null
  // One colour for all points (blue, green, red); without it the colours of the cloud, or light
  // grey.
  std::optional<cv::Vec3b> colour = {};
  // One value for each point, shown by colour from 0 to max_value; goes before `colour`.
  std::span<const double> values = {};
  double max_value = 1;
};

// Splats with a z-buffer, as large as the points' radii or, without, as their neighbours are far;
// shaded by the surface that they form. White where nothing is. CV_8UC3, size of the view, no text.
// Throws Error when `values` has another length than the cloud.
cv::Mat RenderClouds(std::span<const CloudLayer> layers, const CloudView& view);

// One row per view: the estimate on the left, the truth on the right, each in its own colours, with
// titles. Both must be in one frame. CV_8UC3.
cv::Mat CloudsSideBySide(const PointCloud& estimate_in_truth, const PointCloud& truth,
                         std::span<const CloudView> views);

// The two in one picture, one row per view, in the paper's colours: estimate yellow, truth
// blue; the nearer surface hides the other. CV_8UC3.
cv::Mat CloudsInTwoColours(const PointCloud& estimate_in_truth, const PointCloud& truth,
                           std::span<const CloudView> views);

// The estimate coloured by the distance of each point, from 0 to `max_distance_m`, one row per
// view, with a colour bar whose numbers are metres and, with `mean_depth_m`, percent of the depth.
// CV_8UC3.
cv::Mat CloudByDistance(const PointCloud& estimate_in_truth, std::span<const double> distances_m,
                        double max_distance_m, std::span<const CloudView> views,
                        std::optional<double> mean_depth_m = {});

}  // namespace mono3d
