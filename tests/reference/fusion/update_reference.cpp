// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>

#include "reference/fusion/fusion_reference.h"
#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

std::uint32_t Pack16(std::uint32_t low, std::uint32_t high) {
  return std::min(low, 0xFFFFU) | (std::min(high, 0xFFFFU) << 16);
}

std::uint32_t ConfidenceSteps(float confidence) {
  return static_cast<std::uint32_t>(confidence * 256 + 0.5F);
}

Vector3f RayOfPixel(const ViewParams& view, std::size_t pixel) {
  return Ray(view, static_cast<float>(pixel % view.width_px),
             static_cast<float>(pixel / view.width_px));
}

Surfels::Float4 Join(const Vector3f& v, float w) { return {v.x(), v.y(), v.z(), w}; }

// Each channel of 8 bits in `measured`, of 10 in the rest. Where one of the two is as bright as can
// be, the other one stands.
std::uint32_t MixColour(std::uint32_t old, std::uint32_t measured, float share) {
  std::uint32_t mixed = 0;
  for (unsigned channel = 0; channel < 3; ++channel) {
    const auto a = static_cast<float>((old >> (10 * channel)) & 0x3FFU);
    const auto b = static_cast<float>(((measured >> (8 * channel)) & 0xFFU) * 4);
    float merged = a * (1 - share) + b * share;
    if (a >= 1020) merged = b;
    if (b >= 1020) merged = a;
    mixed |= static_cast<std::uint32_t>(merged + 0.5F) << (10 * channel);
  }
  return mixed;
}

std::uint32_t Colour10(std::uint32_t rgb8) {
  return (rgb8 & 0xFFU) * 4 | (rgb8 >> 8 & 0xFFU) * 4 << 10 | (rgb8 >> 16 & 0xFFU) * 4 << 20;
}

void MergeOne(const ViewParams& view, const AnchorTransforms& anchors, const PackedDepthMap& map,
              const Candidates& candidates, std::size_t pixel, Surfels& surfels, std::size_t i) {
  auto& position = surfels.position_radius[i];
  auto& normal = surfels.normal_weight[i];
  auto& history = surfels.history[i];
  const CameraFromAnchor to_camera = FromAnchorOf(anchors, surfels, i);
  const float old_weight = to_camera.Weight(normal[3]);
  const Vector3f p_cam = to_camera.Point(Head(position));
  const Vector3f ray(p_cam.x() / p_cam.z(), p_cam.y() / p_cam.z(), 1);
  const Vector3f pixel_ray = RayOfPixel(view, pixel);
  const Vector3f n_measured = Head(candidates[pixel]);
  const float confidence = candidates[pixel][3];

  const double w = 1.0 / p_cam.z();
  const double measured =
      TangentPlaneInverseDepth(n_measured, pixel_ray, 1 / map.depth[pixel], ray);
  const double sigma =
      InverseDepthSigma(view, static_cast<float>(measured)) / (measured * measured);
  const double weight = confidence / (sigma * sigma);
  // Information on inverse depth is that on depth times z^4.
  const double of_surfel = old_weight / std::pow(w, 4);
  const double of_pixel = weight / std::pow(measured, 4);
  const double merged = (w * of_surfel + measured * of_pixel) / (of_surfel + of_pixel);
  const auto share = static_cast<float>(weight / (weight + old_weight));

  const float radius = SurfelRadius(view, map.depth[pixel], n_measured, pixel_ray);
  position = Join(to_camera.PointToAnchor(ray / static_cast<float>(merged)),
                  std::min(position[3], radius / to_camera.scale));
  const Vector3f n = (1 - share) * Head(normal) + share * to_camera.DirectionToAnchor(n_measured);
  normal = Join(n.normalized(), normal[3] + to_camera.WeightToAnchor(static_cast<float>(weight)));
  const std::uint32_t is_coarse = IsCoarseMatch(history) || (map.colour[pixel] >> 24 & 1U) != 0;
  history = {MixColour(history[0], map.colour[pixel], share) | is_coarse << 30,
             Pack16(Low16(history[1]) + 1, High16(history[1])),
             Pack16(Low16(history[2]), view.map_index),
             Pack16(Low16(history[3]), High16(history[3]) + ConfidenceSteps(confidence))};
}

}  // namespace

void Merge(const ViewParams& view, const AnchorTransforms& anchors, const PackedDepthMap& map,
           const Candidates& candidates, const std::vector<std::uint32_t>& association,
           Surfels& surfels) {
  for (std::size_t i = 0; i < association.size(); ++i) {
    if (!IsPixel(association[i])) continue;
    MergeOne(view, anchors, map, candidates, association[i], surfels, i);
  }
}

std::uint32_t ClearFreeSpace(const ViewParams& view, const std::vector<std::uint32_t>& association,
                             Surfels& surfels) {
  std::uint32_t num_removed = 0;
  for (std::size_t i = view.first_surfel; i < association.size(); ++i) {
    const bool is_seen_through = Says(association[i], kSeenThrough);
    if (!is_seen_through && !Says(association[i], kHidden)) continue;
    const double confidence = (association[i] & 0xFFU) / 255.0;
    auto& counts = surfels.history[i][1];
    double seen_through = (counts >> 16 & 0xFFU) / 8.0;
    double hidden = (counts >> 24) / 255.0;
    (is_seen_through ? seen_through : hidden) += confidence;
    counts = Low16(counts) |
             static_cast<std::uint32_t>(std::lround(std::min(seen_through * 8, 255.0))) << 16 |
             static_cast<std::uint32_t>(std::lround(std::min(hidden * 255, 255.0))) << 24;
    const std::uint32_t against = SeenThroughAgainst(surfels.history[i]) +
                                  (Low16(counts) == 1 ? HiddenAgainst(surfels.history[i]) : 0);
    if (view.is_past != 0 || against < ConfidenceFor(surfels.history[i])) continue;
    surfels.normal_weight[i] = {0, 0, 0, 0};
    ++num_removed;
  }
  return num_removed;
}

std::uint32_t GiveWay(const std::vector<std::uint32_t>& association, Surfels& surfels) {
  std::uint32_t num_removed = 0;
  for (std::size_t i = 0; i < association.size(); ++i) {
    if (IsRemoved(surfels, i) || !IsPixel(association[i])) continue;
    surfels.normal_weight[i] = {0, 0, 0, 0};
    ++num_removed;
  }
  return num_removed;
}

void Insert(const ViewParams& view, const PackedDepthMap& map, const Candidates& candidates,
            const std::vector<std::uint32_t>& selected, Surfels& surfels) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if ((selected[i / 32] >> (i % 32) & 1U) == 0) continue;
    const float z = map.depth[i];
    const Vector3f n = Head(candidates[i]);
    const float confidence = candidates[i][3];
    const Vector3f ray = RayOfPixel(view, i);
    const float sigma = InverseDepthSigma(view, 1 / z) * z * z;
    surfels.position_radius.push_back(Join(ray * z, SurfelRadius(view, z, n, ray)));
    surfels.normal_weight.push_back(Join(n, confidence / (sigma * sigma)));
    const std::uint32_t is_coarse = map.colour[i] >> 24 & 1U;
    surfels.history.push_back({Colour10(map.colour[i]) | is_coarse << 30, Pack16(1, 0),
                               Pack16(view.map_index, view.map_index),
                               Pack16(view.map_index, ConfidenceSteps(confidence))});
  }
}

void Integrate(const ViewParams& view, const AnchorTransforms& anchors, const PackedDepthMap& map,
               Surfels& surfels) {
  const Candidates candidates = Prepare(view, map);
  const auto association = Associate(view, anchors, map, candidates, surfels);
  const auto index_map = DrawIndexMap(view, anchors, surfels, association);
  const auto selected = SelectNew(view, anchors, map, candidates, index_map, surfels);
  Merge(view, anchors, map, candidates, association, surfels);
  ClearFreeSpace(view, association, surfels);
  Insert(view, map, candidates, selected, surfels);
}

}  // namespace mono3d::reference
