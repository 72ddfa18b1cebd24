// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/surfel.h"
#include "fusion/view.params.h"

namespace mono3d::reference {

using Eigen::Vector2f;
using Eigen::Vector3f;

inline Vector3f Head(const Surfels::Float4& v) { return {v[0], v[1], v[2]}; }

// In this order of additions, as the shaders.
inline float Dot(const Vector3f& a, const Vector3f& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

inline Vector3f Row(const ViewParams& view, int row) {
  const float* m = view.cam_from_world + 4 * row;
  return {m[0], m[1], m[2]};
}
inline Vector3f Column(const ViewParams& view, int col) {
  const float* m = view.cam_from_world + col;
  return {m[0], m[4], m[8]};
}

inline Vector3f DirectionToCamera(const ViewParams& view, const Vector3f& v) {
  return {Dot(Row(view, 0), v), Dot(Row(view, 1), v), Dot(Row(view, 2), v)};
}
inline Vector3f DirectionToWorld(const ViewParams& view, const Vector3f& v) {
  return {Dot(Column(view, 0), v), Dot(Column(view, 1), v), Dot(Column(view, 2), v)};
}
inline Vector3f PointToCamera(const ViewParams& view, const Vector3f& p_world) {
  return DirectionToCamera(view, p_world) + Column(view, 3);
}
inline Vector3f PointToWorld(const ViewParams& view, const Vector3f& p_cam) {
  return DirectionToWorld(view, p_cam - Column(view, 3));
}

inline Vector2f Project(const ViewParams& view, const Vector3f& p_cam) {
  return {view.fx * (p_cam.x() / p_cam.z()) + view.cx, view.fy * (p_cam.y() / p_cam.z()) + view.cy};
}
inline Vector3f Ray(const ViewParams& view, float u, float v) {
  return {(u - view.cx) / view.fx, (v - view.cy) / view.fy, 1};
}

inline float InverseDepthSigma(const ViewParams& view, float inverse_depth) {
  return std::max(view.inverse_depth_sigma, view.relative_sigma * inverse_depth);
}
inline float JointSigma(const ViewParams& view, float measured, float of_surfel, float weight) {
  const float a = InverseDepthSigma(view, measured);
  const float b = of_surfel * of_surfel / std::sqrt(weight);
  return std::sqrt(a * a + b * b);
}
inline float TangentPlaneInverseDepth(const Vector3f& n_cam, const Vector3f& measured_ray,
                                      float measured, const Vector3f& ray) {
  const float at_measurement = Dot(n_cam, measured_ray);
  const float along_ray = Dot(n_cam, ray);
  if (at_measurement > -1e-3F || along_ray > -1e-3F) return measured;
  return measured * (along_ray / at_measurement);
}
inline float SurfelRadius(const ViewParams& view, float depth, const Vector3f& n_cam,
                          const Vector3f& ray) {
  const float cosine = -Dot(n_cam, ray) / std::sqrt(Dot(ray, ray));
  return 1.41421356F * depth / std::min(view.fx, view.fy) / std::max(cosine, 0.25F);
}

// Index of the pixel onto which a point falls, out of width x height, each `cells` times as fine.
inline std::optional<std::size_t> CellOf(const ViewParams& view, const Vector3f& p_cam, int cells) {
  if (p_cam.z() <= 0) return std::nullopt;
  const auto scale = static_cast<float>(cells);
  const Vector2f pixel = Project(view, p_cam);
  const float x = std::floor((pixel.x() + 0.5F) * scale);
  const float y = std::floor((pixel.y() + 0.5F) * scale);
  const float width = static_cast<float>(view.width_px) * scale;
  const float height = static_cast<float>(view.height_px) * scale;
  // Written so that NaN fails.
  if (!(x >= 0 && y >= 0 && x < width && y < height)) return std::nullopt;
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

}  // namespace mono3d::reference
