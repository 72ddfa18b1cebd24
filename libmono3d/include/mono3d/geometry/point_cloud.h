// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Points with what is known of them. Each list is empty or as long as `points`.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;               // su
  std::vector<Eigen::Vector3f> normals;              // unit length, outwards
  std::vector<std::array<std::uint8_t, 3>> colours;  // red, green, blue
  std::vector<float> radii;                          // su
  std::vector<float> confidences;                    // 0 to 1
  std::vector<std::uint32_t> observations;           // depth maps that saw the point
  // 1 where nobody matched the point, but inferred it from the surface around. Empty: no point.
  std::vector<std::uint8_t> inferred = {};
  std::vector<std::uint32_t> first_frames = {};  // whose depth map saw the point first

  std::size_t size() const { return points.size(); }
  bool empty() const { return points.empty(); }
};

// Throws Error, with `name` as the place, when the cloud is empty, holds a coordinate or a normal
// that is not finite, or lists of differing lengths.
void CheckCloud(const PointCloud& cloud, const std::string& name);

bool IsInferred(const PointCloud& cloud, std::size_t i);
// With the inferred points alone, or without them, in their order.
PointCloud InferredPoints(const PointCloud& cloud);
PointCloud MatchedPoints(const PointCloud& cloud);

// The points in double precision.
std::vector<Eigen::Vector3d> CloudPoints(const PointCloud& cloud);

}  // namespace mono3d
