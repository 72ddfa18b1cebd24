// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cmath>
#include <cstdint>

#include "fusion/surfel.h"
#include "fusion/view.params.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2

// shaders/fusion/view.glsl for eight lanes at once: the same operations in the same order.
namespace mono3d::host {

// From the frame of an anchor, in its unit, into the camera's, in the depth map's.
struct CameraFromAnchor {
  Vec3 x, y, z;  // rows of the rotation
  Vec3 translation;
  __m256 scale;
};

// Of each lane: a unit quaternion, and translation and scale.
MONO3D_AVX2 inline CameraFromAnchor MakeCameraFromAnchor(const Vec4& q,
                                                         const Vec4& translation_scale) {
  const __m256 one = Splat(1.0F);
  const __m256 two = Splat(2.0F);
  const __m256 x2 = two * q.x, y2 = two * q.y, z2 = two * q.z, w2 = two * q.w;
  const __m256 xx = x2 * q.x, yy = y2 * q.y, zz = z2 * q.z;
  const __m256 xy = x2 * q.y, xz = x2 * q.z, yz = y2 * q.z;
  const __m256 wx = w2 * q.x, wy = w2 * q.y, wz = w2 * q.z;
  return {.x = {one - yy - zz, xy - wz, xz + wy},
          .y = {xy + wz, one - xx - zz, yz - wx},
          .z = {xz - wy, yz + wx, one - xx - yy},
          .translation = {translation_scale.x, translation_scale.y, translation_scale.z},
          .scale = translation_scale.w};
}

// The same anchor in all lanes; `anchors` is the table, two vectors of four floats each.
MONO3D_AVX2 inline CameraFromAnchor FromAnchor(const float* anchors, std::uint32_t anchor) {
  const float* const of = anchors + 8 * std::size_t{anchor};
  return MakeCameraFromAnchor({Splat(of[0]), Splat(of[1]), Splat(of[2]), Splat(of[3])},
                              {Splat(of[4]), Splat(of[5]), Splat(of[6]), Splat(of[7])});
}

MONO3D_AVX2 inline Vec3 DirectionToCamera(const CameraFromAnchor& from, const Vec3& v) {
  return {Dot(from.x, v), Dot(from.y, v), Dot(from.z, v)};
}
MONO3D_AVX2 inline Vec3 DirectionToAnchor(const CameraFromAnchor& from, const Vec3& v) {
  return {Dot({from.x.x, from.y.x, from.z.x}, v), Dot({from.x.y, from.y.y, from.z.y}, v),
          Dot({from.x.z, from.y.z, from.z.z}, v)};
}
MONO3D_AVX2 inline Vec3 PointToCamera(const CameraFromAnchor& from, const Vec3& p) {
  const Vec3 turned =
      DirectionToCamera(from, {from.scale * p.x, from.scale * p.y, from.scale * p.z});
  return {turned.x + from.translation.x, turned.y + from.translation.y,
          turned.z + from.translation.z};
}
MONO3D_AVX2 inline Vec3 PointToAnchor(const CameraFromAnchor& from, const Vec3& p) {
  const Vec3 turned = DirectionToAnchor(
      from, {p.x - from.translation.x, p.y - from.translation.y, p.z - from.translation.z});
  return {turned.x / from.scale, turned.y / from.scale, turned.z / from.scale};
}
MONO3D_AVX2 inline __m256 WeightToCamera(const CameraFromAnchor& from, __m256 weight) {
  return weight / (from.scale * from.scale);
}
MONO3D_AVX2 inline __m256 WeightToAnchor(const CameraFromAnchor& from, __m256 weight) {
  return weight * (from.scale * from.scale);
}

struct Vec2 {
  __m256 x, y;
};

// Column and row of pixels by their numbers, as Divide of view.glsl: processors have no division of
// whole numbers for vectors. The estimate is off by one at most.
MONO3D_AVX2 inline Vec2 ColumnAndRow(const ViewParams& view, __m256i number) {
  const __m256i width = Splat(static_cast<int>(view.width_px));
  const __m256 estimate =
      _mm256_cvtepi32_ps(number) * Splat(1.0F / static_cast<float>(view.width_px));
  const __m256i row = _mm256_cvttps_epi32(estimate);
  const __m256i column = _mm256_sub_epi32(number, _mm256_mullo_epi32(row, width));
  const __m256i too_far = _mm256_cmpgt_epi32(_mm256_setzero_si256(), column);  // -1: row - 1
  const __m256i too_near = _mm256_cmpgt_epi32(column, _mm256_sub_epi32(width, Splat(1)));
  const __m256i step = _mm256_sub_epi32(too_far, too_near);  // to the row
  return {_mm256_cvtepi32_ps(_mm256_sub_epi32(column, _mm256_mullo_epi32(step, width))),
          _mm256_cvtepi32_ps(_mm256_add_epi32(row, step))};
}

MONO3D_AVX2 inline Vec2 Project(const ViewParams& view, const Vec3& p) {
  return {Splat(view.fx) * (p.x / p.z) + Splat(view.cx),
          Splat(view.fy) * (p.y / p.z) + Splat(view.cy)};
}
MONO3D_AVX2 inline Vec3 RayOf(const ViewParams& view, const Vec2& pixel) {
  return {(pixel.x - Splat(view.cx)) / Splat(view.fx), (pixel.y - Splat(view.cy)) / Splat(view.fy),
          Splat(1.0F)};
}

MONO3D_AVX2 inline __m256 InverseDepthSigma(const ViewParams& view, __m256 inverse_depth) {
  return _mm256_max_ps(Splat(view.inverse_depth_sigma), Splat(view.relative_sigma) * inverse_depth);
}
MONO3D_AVX2 inline __m256 JointSigma(const ViewParams& view, __m256 measured_inverse_depth,
                                     __m256 surfel_inverse_depth, __m256 surfel_weight) {
  const __m256 measured = InverseDepthSigma(view, measured_inverse_depth);
  const __m256 of_surfel =
      surfel_inverse_depth * surfel_inverse_depth / _mm256_sqrt_ps(surfel_weight);
  return _mm256_sqrt_ps(measured * measured + of_surfel * of_surfel);
}
// Of one lane.
inline float JointSigma(const ViewParams& view, float measured_inverse_depth,
                        float surfel_inverse_depth, float surfel_weight) {
  const float relative = view.relative_sigma * measured_inverse_depth;
  const float measured = view.inverse_depth_sigma > relative ? view.inverse_depth_sigma : relative;
  const float of_surfel = surfel_inverse_depth * surfel_inverse_depth / std::sqrt(surfel_weight);
  return std::sqrt(measured * measured + of_surfel * of_surfel);
}

MONO3D_AVX2 inline __m256 TangentPlaneInverseDepth(const Vec3& n_cam, const Vec3& measured_ray,
                                                   __m256 measured_inverse_depth, const Vec3& ray) {
  const __m256 at_measurement = Dot(n_cam, measured_ray);
  const __m256 along_ray = Dot(n_cam, ray);
  const __m256 edge = Splat(-1e-3F);
  const __m256 beyond = _mm256_or_ps(Less(edge, at_measurement), Less(edge, along_ray));
  return Select(beyond, measured_inverse_depth,
                measured_inverse_depth * (along_ray / at_measurement));
}

}  // namespace mono3d::host
#endif
