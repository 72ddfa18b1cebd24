// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <bit>

#include "reference/fusion/fusion_reference.h"
#include "reference/fusion/view_reference.h"

namespace mono3d::reference {

std::vector<IndexCell> DrawIndexMap(const ViewParams& view, const AnchorTransforms& anchors,
                                    const Surfels& surfels,
                                    const std::vector<std::uint32_t>& association) {
  std::vector<IndexCell> index_map(std::size_t{view.width_px} * view.height_px *
                                   kIndexCellsPerPixel * kIndexCellsPerPixel);
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i) || Says(association[i], kSeenThrough)) continue;
    const CameraFromAnchor to_camera = FromAnchorOf(anchors, surfels, i);
    const Vector3f p_cam = to_camera.Point(Head(surfels.position_radius[i]));
    const Vector3f normal = to_camera.Direction(Head(surfels.normal_weight[i]));
    const auto cell = CellOf(view, p_cam, kIndexCellsPerPixel);
    if (!cell || Dot(normal, p_cam) >= 0) continue;
    const auto depth_bits = std::bit_cast<std::uint32_t>(p_cam.z());
    // Later surfels win only when they are nearer, so of equals the first stays.
    if (depth_bits < index_map[*cell].depth_bits) {
      index_map[*cell] = {static_cast<std::uint32_t>(i), depth_bits};
    }
  }
  return index_map;
}

}  // namespace mono3d::reference
