// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/fusion/overlap_reference.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

// A surfel in the camera's frame and the unit of its depth map.
struct SurfelInCamera {
  SurfelInCamera(const AnchorTransforms& anchors, const Surfels& surfels, std::size_t i) {
    const CameraFromAnchor to_camera = FromAnchorOf(anchors, surfels, i);
    p = to_camera.Point(Head(surfels.position_radius[i]));
    n = to_camera.Direction(Head(surfels.normal_weight[i]));
    radius = to_camera.scale * surfels.position_radius[i][3];
    weight = to_camera.Weight(surfels.normal_weight[i][3]);
  }

  // What it says of the inverse depth along `ray`.
  float InverseDepthAlong(const Vector3f& ray) const {
    return TangentPlaneInverseDepth(n, p / p.z(), 1 / p.z(), ray);
  }

  Vector3f p, n;
  float radius, weight;
};

float Sigma(const ViewParams& view, float inverse_depth, float weight) {
  return std::max(inverse_depth * inverse_depth / std::sqrt(weight),
                  view.relative_sigma * inverse_depth);
}

bool IsSamePlace(const SurfelInCamera& own, const SurfelInCamera& other) {
  const Vector3f offset = other.p - own.p;
  return (offset - offset.dot(own.n) * own.n).norm() <=
         0.7071F * std::min(own.radius, other.radius);
}

bool IsSameSurface(const ViewParams& view, const SurfelInCamera& own, const SurfelInCamera& other,
                   const Vector2f& pixel_of_other, float inverse_depth_of_other) {
  const Vector3f ray = Ray(view, pixel_of_other.x(), pixel_of_other.y());
  const float difference = std::abs(inverse_depth_of_other - own.InverseDepthAlong(ray));
  const float sigma = std::hypot(Sigma(view, 1 / own.p.z(), own.weight),
                                 Sigma(view, inverse_depth_of_other, other.weight));
  return Dot(other.n, own.n) >= view.min_normal_cosine &&
         difference <= view.association_sigmas * sigma && IsSamePlace(own, other);
}

std::uint32_t FindTarget(const ViewParams& view, const AnchorTransforms& anchors,
                         const std::vector<std::uint32_t>& end_of_older,
                         const std::vector<IndexCell>& index_map, const Surfels& surfels,
                         std::size_t i) {
  if (IsRemoved(surfels, i)) return kNone;
  const SurfelInCamera own(anchors, surfels, i);
  if (own.p.z() <= 0 || own.n.dot(own.p) >= 0) return kNone;
  const Vector2f pixel = Project(view, own.p);
  const int width = static_cast<int>(view.width_px) * 2;
  const int height = static_cast<int>(view.height_px) * 2;
  const int u0 = static_cast<int>(std::floor((pixel.x() + 0.5F) * 2));
  const int v0 = static_cast<int>(std::floor((pixel.y() + 0.5F) * 2));
  std::uint32_t best = kNone;
  float nearest = 3.4e38F;
  Vector2f best_pixel(0, 0);
  float best_inverse_depth = 0;
  for (int v = v0 - 2; v <= v0 + 2; ++v) {
    for (int u = u0 - 2; u <= u0 + 2; ++u) {
      if (u < 0 || v < 0 || u >= width || v >= height) continue;
      const IndexCell& cell = index_map[static_cast<std::size_t>(v * width + u)];
      const std::uint32_t j = cell.surfel;
      if (j >= end_of_older[AnchorOf(surfels, i)]) continue;
      const float w = 1 / std::bit_cast<float>(cell.depth_bits);
      const Vector2f at((static_cast<float>(u) + 0.5F) / 2 - 0.5F,
                        (static_cast<float>(v) + 0.5F) / 2 - 0.5F);
      const float difference = std::abs(w - own.InverseDepthAlong(Ray(view, at.x(), at.y())));
      if (difference > 2 * view.association_sigmas * Sigma(view, 1 / own.p.z(), own.weight)) {
        continue;
      }
      const float distance = (at - pixel).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      best = j;
      best_pixel = at;
      best_inverse_depth = w;
    }
  }
  if (best == kNone) return kNone;
  const SurfelInCamera other(anchors, surfels, best);
  return IsSameSurface(view, own, other, best_pixel, best_inverse_depth) ? best : kNone;
}

}  // namespace

std::vector<std::uint32_t> FindTargets(const ViewParams& view, const AnchorTransforms& anchors,
                                       const std::vector<std::uint32_t>& end_of_older,
                                       const std::vector<IndexCell>& index_map,
                                       const Surfels& surfels) {
  std::vector<std::uint32_t> targets;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    targets.push_back(FindTarget(view, anchors, end_of_older, index_map, surfels, i));
  }
  return targets;
}

std::uint32_t AddToTargets(const AnchorTransforms& anchors,
                           const std::vector<std::uint32_t>& targets, Surfels& surfels) {
  struct Sums {
    std::uint32_t observations = 0, confidence = 0;
    float share = 0, shift = 0;
  };
  std::vector<Sums> sums(surfels.size());
  const Surfels before = surfels;
  std::uint32_t num_removed = 0;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const std::uint32_t j = targets[i];
    if (j == kNone || targets[j] != kNone) continue;
    const SurfelInCamera own(anchors, before, i);
    const SurfelInCamera other(anchors, before, j);
    const float share = own.weight / other.weight;
    const float w = 1 / other.p.z();
    sums[j].observations += Low16(before.history[i][1]);
    sums[j].confidence += High16(before.history[i][3]);
    sums[j].share += share;
    sums[j].shift += share * (own.InverseDepthAlong(other.p * w) - w);
    surfels.normal_weight[i] = {0, 0, 0, 0};
    ++num_removed;
  }
  for (std::size_t j = 0; j < surfels.size(); ++j) {
    if (sums[j].observations == 0) continue;
    const CameraFromAnchor to_camera = FromAnchorOf(anchors, before, j);
    const Vector3f p = to_camera.Point(Head(before.position_radius[j]));
    const float merged = 1 / p.z() + sums[j].shift / (1 + sums[j].share);
    const Vector3f moved = to_camera.PointToAnchor(p / p.z() / merged);
    for (std::size_t k = 0; k < 3; ++k)
      surfels.position_radius[j].at(k) = moved(static_cast<int>(k));
    surfels.normal_weight[j][3] *= 1 + sums[j].share;
    surfels.history[j][1] += sums[j].observations;
    surfels.history[j][3] += sums[j].confidence << 16;
  }
  return num_removed;
}

}  // namespace mono3d::reference
