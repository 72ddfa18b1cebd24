// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/types.hpp>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/triangle_mesh.h"
#include "products/view_choice.h"

namespace mono3d {

// Where a view was taken from, free of distortion.
struct PinholeView {
  CameraModel camera;
  Pose T_cam_world;

  Eigen::Vector2f Pixel(const Eigen::Vector3f& p_world) const {
    return camera.Project(T_cam_world * p_world.cast<double>()).cast<float>();
  }
};

// Where the triangles of a mesh lie in its textures. Triangles that hang together and have one view
// are a chart, which is as the view shows it; one without a view is a chart of a few texels.
struct ChartAtlas {
  std::size_t num_charts = 0;
  std::vector<std::uint32_t> chart;    // of each triangle
  std::vector<std::uint32_t> texture;  // of each triangle
  // Of each triangle's corners; texel (0, 0) is the centre of the top-left one.
  std::vector<std::array<Eigen::Vector2f, 3>> texels;
  std::vector<cv::Size> textures;
  double texels_per_pixel = 1;
};

// Texels around each chart that belong to no other one: what filters take from beside it.
inline constexpr int kGutter_px = 2;

// `side_px`: of a texture at most. Charts are scaled down until `max_textures` hold them.
ChartAtlas PackCharts(const TriangleMesh& mesh, const std::vector<std::uint32_t>& chosen,
                      const TriangleNeighbours& neighbours, std::span<const PinholeView> views,
                      int side_px, int max_textures);

}  // namespace mono3d
