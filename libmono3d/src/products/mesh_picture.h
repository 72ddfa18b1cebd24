// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace mono3d {

// How a view shows a triangle.
struct SeenTriangle {
  float area_px = 0;  // in the image
  // The surface goes on around it; else some of its pixels may be of what is in front of it or, at
  // the outline of something, of what is behind.
  bool is_clear = false;
};

// A mesh as a camera sees it: which of its triangles, and where.
class MeshPicture {
 public:
  // `camera` is free of distortion.
  MeshPicture(const TriangleMesh& mesh, const CameraModel& camera, const Pose& T_world_cam,
              double surface_error_su);

  // Nothing: the triangle is not in the image as a whole, is hidden, or is seen from behind.
  std::optional<SeenTriangle> See(std::size_t triangle) const;
  // Where the view shows a vertex; only of triangles that it sees.
  const Eigen::Vector2f& Pixel(std::uint32_t vertex) const { return pixels_[vertex]; }

 private:
  const TriangleMesh& mesh_;
  CameraModel camera_;
  Pose T_cam_world_;
  double surface_error_su_;
  std::vector<Eigen::Vector2f> pixels_;
  std::vector<float> inverse_depths_;  // 0: behind the camera, or beside the image by far
  cv::Mat nearest_;                    // CV_32FC1, inverse depth of the nearest triangle; 0: none
  cv::Mat nearest_around_;             // the largest of the pixels around as well
  cv::Mat farthest_around_;            // the smallest of these
};

// Bilinear between pixels, blue, green and red; `pixel` is in the image.
Eigen::Vector3f ColourAt(const cv::Mat& bgr, const Eigen::Vector2f& pixel);

}  // namespace mono3d
