// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/surfel.h"
#include "fusion/view.params.h"
#include "reference/fusion/fusion_reference.h"

namespace mono3d::reference {

using Eigen::Vector2f;
using Eigen::Vector3f;

inline Vector3f Head(const Surfels::Float4& v) { return {v[0], v[1], v[2]}; }

// In this order of additions, as the shaders.
inline float Dot(const Vector3f& a, const Vector3f& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

// From the frame of an anchor into the camera's; in this order of operations, as the shaders.
struct CameraFromAnchor {
  Vector3f x, y, z;  // rows of the rotation
  Vector3f translation;
  float scale;

  explicit CameraFromAnchor(const AnchorTransform& transform)
      : translation(Head(transform.translation_scale)), scale(transform.translation_scale[3]) {
    const auto& q = transform.rotation;
    const float xx = 2 * q[0] * q[0], yy = 2 * q[1] * q[1], zz = 2 * q[2] * q[2];
    const float xy = 2 * q[0] * q[1], xz = 2 * q[0] * q[2], yz = 2 * q[1] * q[2];
    const float wx = 2 * q[3] * q[0], wy = 2 * q[3] * q[1], wz = 2 * q[3] * q[2];
    x = {1 - yy - zz, xy - wz, xz + wy};
    y = {xy + wz, 1 - xx - zz, yz - wx};
    z = {xz - wy, yz + wx, 1 - xx - yy};
  }

  Vector3f Direction(const Vector3f& v) const { return {Dot(x, v), Dot(y, v), Dot(z, v)}; }
  Vector3f Point(const Vector3f& p_anchor) const {
    return Direction(scale * p_anchor) + translation;
  }
  float Weight(float weight_anchor) const { return weight_anchor / (scale * scale); }

  Vector3f DirectionToAnchor(const Vector3f& v) const {
    return {Dot({x.x(), y.x(), z.x()}, v), Dot({x.y(), y.y(), z.y()}, v),
            Dot({x.z(), y.z(), z.z()}, v)};
  }
  Vector3f PointToAnchor(const Vector3f& p_cam) const {
    return DirectionToAnchor(p_cam - translation) / scale;
  }
  float WeightToAnchor(float weight_cam) const { return weight_cam * (scale * scale); }
};

inline CameraFromAnchor FromAnchorOf(const AnchorTransforms& anchors, const Surfels& surfels,
                                     std::size_t i) {
  return CameraFromAnchor(anchors[AnchorOf(surfels, i)]);
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
