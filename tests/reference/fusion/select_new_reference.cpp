// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <bit>
#include <limits>

#include "reference/fusion/fusion_reference.h"
#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

bool Covered(const ViewParams& view, const AnchorTransforms& anchors, int x, int y,
             const Vector3f& n_cam, float measured, const std::vector<IndexCell>& index_map,
             const Surfels& surfels) {
  const int margin = kIndexCellsPerPixel * static_cast<int>(view.merge_radius_px) - 1;
  const int width = static_cast<int>(view.width_px) * kIndexCellsPerPixel;
  const int height = static_cast<int>(view.height_px) * kIndexCellsPerPixel;
  const Vector3f pixel_ray = Ray(view, static_cast<float>(x), static_cast<float>(y));
  float best_difference = std::numeric_limits<float>::max();
  float best_inverse_depth = 0;
  std::uint32_t best_surfel = 0;
  for (int row = y * 2 - margin; row < y * 2 + 2 + margin; ++row) {
    for (int col = x * 2 - margin; col < x * 2 + 2 + margin; ++col) {
      if (row < 0 || col < 0 || row >= height || col >= width) continue;
      const IndexCell& cell = index_map[static_cast<std::size_t>(row * width + col)];
      if (cell == IndexCell{}) continue;
      const float inverse_depth = 1 / std::bit_cast<float>(cell.depth_bits);
      const Vector3f ray = Ray(view, (static_cast<float>(col) + 0.5F) / 2 - 0.5F,
                               (static_cast<float>(row) + 0.5F) / 2 - 0.5F);
      const float expected = TangentPlaneInverseDepth(n_cam, pixel_ray, measured, ray);
      const float difference = std::abs(inverse_depth - expected);
      if (difference >= best_difference) continue;
      best_difference = difference;
      best_inverse_depth = inverse_depth;
      best_surfel = cell.surfel;
    }
  }
  if (best_difference == std::numeric_limits<float>::max()) return false;
  const auto& normal_weight = surfels.normal_weight[best_surfel];
  const CameraFromAnchor to_camera = FromAnchorOf(anchors, surfels, best_surfel);
  const float weight = to_camera.Weight(normal_weight[3]);
  const float sigma = JointSigma(view, measured, best_inverse_depth, weight);
  const Vector3f normal = to_camera.Direction(Head(normal_weight));
  return best_difference <= view.association_sigmas * sigma &&
         Dot(normal, n_cam) >= view.min_normal_cosine;
}

}  // namespace

std::vector<std::uint32_t> SelectNew(const ViewParams& view, const AnchorTransforms& anchors,
                                     const PackedDepthMap& map, const Candidates& candidates,
                                     const std::vector<IndexCell>& index_map,
                                     const Surfels& surfels) {
  std::vector<std::uint32_t> selected((candidates.size() + 31) / 32, 0);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i][3] <= 0) continue;
    const int x = static_cast<int>(i % view.width_px);
    const int y = static_cast<int>(i / view.width_px);
    if (Covered(view, anchors, x, y, Head(candidates[i]), 1 / map.depth[i], index_map, surfels))
      continue;
    selected[i / 32] |= 1U << (i % 32);
  }
  return selected;
}

}  // namespace mono3d::reference
