// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/anchor_table.h"

#include <algorithm>

namespace mono3d {

AnchorTransform ToAnchorTransform(const Similarity& S_view_anchor) {
  const Eigen::Vector4f q = S_view_anchor.pose().rotation().coeffs().cast<float>();
  const Eigen::Vector3f t = S_view_anchor.pose().translation().cast<float>();
  return {{q[0], q[1], q[2], q[3]}, {t[0], t[1], t[2], static_cast<float>(S_view_anchor.scale())}};
}

std::vector<AnchorTransform> AnchorTransforms(const Similarity& S_world_view,
                                              std::span<const Similarity> S_world_anchor) {
  const Similarity S_view_world = S_world_view.Inverse();
  std::vector<AnchorTransform> transforms;
  transforms.reserve(S_world_anchor.size());
  for (const Similarity& S : S_world_anchor) {
    transforms.push_back(ToAnchorTransform(S_view_world * S));
  }
  return transforms;
}

void AnchorTable::Set(const std::shared_ptr<Device>& device,
                      std::span<const AnchorTransform> transforms) {
  // One at least, so that there is a buffer to bind.
  const std::size_t bytes = std::max<std::size_t>(transforms.size(), 1) * sizeof(AnchorTransform);
  if (buffer_.size_bytes() < bytes) buffer_ = Buffer(device, 2 * bytes, "fusion/anchors");
  if (!transforms.empty()) buffer_.Upload(transforms);
  transforms_.assign(transforms.begin(), transforms.end());
}

}  // namespace mono3d
