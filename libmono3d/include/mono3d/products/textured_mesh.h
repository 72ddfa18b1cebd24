// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Triangles with images upon them. A vertex is there once for each piece of an image that ends at
// it.
struct TexturedMesh {
  std::vector<Eigen::Vector3f> vertices;  // su
  std::vector<Eigen::Vector3f> normals;   // unit length, outwards; one per vertex
  // One per vertex: 0 to 1 from the left to the right edge of its texture, and from the upper to
  // the lower one, as glTF has it.
  std::vector<Eigen::Vector2f> texture_coordinates;
  // The triangles of each texture.
  std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles;
  std::vector<cv::Mat> textures;  // CV_8UC3 (BGR)
};

}  // namespace mono3d
