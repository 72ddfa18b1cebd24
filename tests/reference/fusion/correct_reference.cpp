// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/fusion/correct_reference.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;
constexpr std::uint32_t kMaxAnchorGap = 3;

float Sigma(const ViewParams& view, float inverse_depth, float weight) {
  return std::max(inverse_depth * inverse_depth / std::sqrt(weight),
                  view.relative_sigma * inverse_depth);
}

// What surfel i says of the inverse depth along `ray`.
float Expected(const ViewParams& view, const Surfels& surfels, std::size_t i, const Vector3f& ray) {
  const Vector3f p = PointToCamera(view, Head(surfels.position_radius[i]));
  const Vector3f n = DirectionToCamera(view, Head(surfels.normal_weight[i]));
  return TangentPlaneInverseDepth(n, p / p.z(), 1 / p.z(), ray);
}

bool IsSamePlace(const Surfels& surfels, std::size_t i, std::size_t j) {
  const auto& a = surfels.position_radius[i];
  const auto& b = surfels.position_radius[j];
  const Vector3f n = Head(surfels.normal_weight[i]);
  const Vector3f offset = Head(b) - Head(a);
  return (offset - offset.dot(n) * n).norm() <= 0.7071F * std::min(a[3], b[3]);
}

// j is of a depth map that came well before that of i.
bool IsOlderPart(const Surfels& surfels, std::size_t i, std::size_t j) {
  return Low16(surfels.history[j][3]) + kMaxAnchorGap < Low16(surfels.history[i][3]);
}

bool IsSameSurface(const ViewParams& view, const Surfels& surfels, std::size_t i, std::size_t j,
                   const Vector2f& pixel_of_j, float inverse_depth_of_j) {
  const auto& own = surfels.normal_weight[i];
  const auto& other = surfels.normal_weight[j];
  const Vector3f p = PointToCamera(view, Head(surfels.position_radius[i]));
  const Vector3f ray = Ray(view, pixel_of_j.x(), pixel_of_j.y());
  const float difference = std::abs(inverse_depth_of_j - Expected(view, surfels, i, ray));
  const float sigma =
      std::hypot(Sigma(view, 1 / p.z(), own[3]), Sigma(view, inverse_depth_of_j, other[3]));
  return Dot(Head(other), Head(own)) >= view.min_normal_cosine &&
         difference <= view.association_sigmas * sigma && IsSamePlace(surfels, i, j);
}

std::uint32_t FindTarget(const ViewParams& view, const std::vector<IndexCell>& index_map,
                         const Surfels& surfels, std::size_t i) {
  const auto& own = surfels.normal_weight[i];
  if (own[3] <= 0) return kNone;
  const Vector3f p = PointToCamera(view, Head(surfels.position_radius[i]));
  if (p.z() <= 0 || DirectionToCamera(view, Head(own)).dot(p) >= 0) return kNone;
  const Vector2f pixel = Project(view, p);
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
      if (j >= i || !IsOlderPart(surfels, i, j)) continue;
      const float w = 1 / std::bit_cast<float>(cell.depth_bits);
      const Vector2f at((static_cast<float>(u) + 0.5F) / 2 - 0.5F,
                        (static_cast<float>(v) + 0.5F) / 2 - 0.5F);
      const float difference = std::abs(w - Expected(view, surfels, i, Ray(view, at.x(), at.y())));
      if (difference > 2 * view.association_sigmas * Sigma(view, 1 / p.z(), own[3])) continue;
      const float distance = (at - pixel).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      best = j;
      best_pixel = at;
      best_inverse_depth = w;
    }
  }
  if (best == kNone) return kNone;
  return IsSameSurface(view, surfels, i, best, best_pixel, best_inverse_depth) ? best : kNone;
}

}  // namespace

void Deform(std::span<const DeformationNode> nodes, std::uint32_t window, Surfels& surfels) {
  using Eigen::Vector3d;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i)) continue;
    const auto anchor = static_cast<int>(Low16(surfels.history[i][3]));
    const int first = std::max(anchor - static_cast<int>(window), 0);
    const int last =
        std::min(anchor + static_cast<int>(window), static_cast<int>(nodes.size()) - 1);
    auto& position = surfels.position_radius[i];
    auto& normal = surfels.normal_weight[i];
    const Vector3d p = Head(position).cast<double>();
    const Vector3d n = Head(normal).cast<double>();
    double farthest = 0;
    for (int k = first; k <= last; ++k) {
      const auto& node = nodes[static_cast<std::size_t>(k)];
      farthest = std::max(farthest, (p - Vector3d(node[12], node[13], node[14])).squaredNorm());
    }
    double sum = 0;
    double scale = 0;
    Vector3d moved = Vector3d::Zero();
    Vector3d turned = Vector3d::Zero();
    for (int k = first; k <= last; ++k) {
      const auto& node = nodes[static_cast<std::size_t>(k)];
      const Vector3d offset = p - Vector3d(node[12], node[13], node[14]);
      const double nearness = 1 - offset.squaredNorm() / std::max(1.01 * farthest, 1e-30);
      const double steps = (k - anchor) / (window + 1.0);
      const double weight = nearness * nearness * (1 - steps * steps);
      sum += weight;
      scale += weight * node[15];
      for (int row = 0; row < 3; ++row) {
        const auto at = static_cast<std::size_t>(4 * row);
        const Vector3d x(node.at(at), node.at(at + 1), node.at(at + 2));
        moved(row) += weight * (x.dot(offset) + node.at(at + 3));
        turned(row) += weight * x.dot(n);
      }
    }
    scale /= sum;
    moved /= sum;
    turned.normalize();
    for (int k = 0; k < 3; ++k) {
      position.at(static_cast<std::size_t>(k)) = static_cast<float>(moved(k));
      normal.at(static_cast<std::size_t>(k)) = static_cast<float>(turned(k));
    }
    position[3] *= static_cast<float>(scale);
    normal[3] /= static_cast<float>(scale * scale);
  }
}

std::vector<std::uint32_t> FindTargets(const ViewParams& view,
                                       const std::vector<IndexCell>& index_map,
                                       const Surfels& surfels) {
  std::vector<std::uint32_t> targets;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    targets.push_back(FindTarget(view, index_map, surfels, i));
  }
  return targets;
}

std::uint32_t AddToTargets(const ViewParams& view, const std::vector<std::uint32_t>& targets,
                           Surfels& surfels) {
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
    const Vector3f p = PointToCamera(view, Head(before.position_radius[j]));
    const float share = before.normal_weight[i][3] / before.normal_weight[j][3];
    sums[j].observations += Low16(before.history[i][1]);
    sums[j].confidence += High16(before.history[i][3]);
    sums[j].share += share;
    sums[j].shift += share * (Expected(view, before, i, p / p.z()) - 1 / p.z());
    surfels.normal_weight[i] = {0, 0, 0, 0};
    ++num_removed;
  }
  for (std::size_t j = 0; j < surfels.size(); ++j) {
    if (sums[j].observations == 0) continue;
    const Vector3f p = PointToCamera(view, Head(before.position_radius[j]));
    const float merged = 1 / p.z() + sums[j].shift / (1 + sums[j].share);
    const Vector3f moved = PointToWorld(view, p / p.z() / merged);
    for (std::size_t k = 0; k < 3; ++k)
      surfels.position_radius[j].at(k) = moved(static_cast<int>(k));
    surfels.normal_weight[j][3] *= 1 + sums[j].share;
    surfels.history[j][1] += sums[j].observations;
    surfels.history[j][3] += sums[j].confidence << 16;
  }
  return num_removed;
}

}  // namespace mono3d::reference
