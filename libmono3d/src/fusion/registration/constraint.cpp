// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/constraint.h"

#include <algorithm>
#include <map>

namespace mono3d {

Matrix7d InformationOf(const RegistrationSystem& system, std::uint32_t stride,
                       const RegistrationOptions& options) {
  const auto count = static_cast<double>(system.num_agree + system.num_grey);
  if (count == 0) return Matrix7d::Zero();
  const double mean_square = (system.depth_cost + system.grey_cost) / count;
  // Variances add up: of independent residuals, and of what they have in common.
  const double independent = std::max(1.0, kPixelsPerMeasurement / stride);
  const double common = count * options.max_misfit * options.max_misfit;
  Matrix7d information = system.information / ((independent + common) * std::max(1.0, mean_square));
  if (!options.with_scale) {
    information.row(6).setZero();
    information.col(6).setZero();
  }
  return information;
}

std::optional<std::uint32_t> AnchorToTellOf(std::span<const std::uint32_t> blocks,
                                            std::span<const std::uint32_t> anchors) {
  constexpr std::size_t kPartOfBlocks = 10;
  std::map<std::uint32_t, std::uint32_t> num_blocks;  // by anchor, the oldest first
  for (const std::uint32_t block : blocks) ++num_blocks[anchors[block]];
  for (const auto& [anchor, count] : num_blocks) {
    if (kPartOfBlocks * count >= blocks.size()) return anchor;
  }
  const auto most = std::ranges::max_element(
      num_blocks, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == num_blocks.end()) return std::nullopt;
  return most->first;
}

KeyframeConstraint MakeConstraint(const PlacedAnchor& placed, const Matrix7d& information,
                                  const PlacedAnchor& anchor) {
  // From the unit of the one depth map into that of the other.
  const Similarity S_anchor_kf = anchor.S_world_kf.Inverse() * placed.S_world_kf;
  // From the unit of a depth map into the own one of its keyframe.
  const double own_of_anchor = anchor.anchor.depth_scale.value();
  const double own_of_kf = placed.anchor.depth_scale.value();
  const Pose T_cam_anchor = S_anchor_kf.pose().Inverse();
  KeyframeConstraint constraint;
  constraint.id = placed.anchor.keyframe_id;
  constraint.anchor_id = anchor.anchor.keyframe_id;
  constraint.T_cam_anchor = {T_cam_anchor.rotation(), own_of_anchor * T_cam_anchor.translation()};
  constraint.scale = own_of_anchor * S_anchor_kf.scale() / own_of_kf;
  Vector7d unit = Vector7d::Ones();  // lengths from the anchor's into the depth map's
  unit.segment<3>(3).setConstant(1 / (own_of_anchor * S_anchor_kf.scale()));
  constraint.information = unit.asDiagonal() * information * unit.asDiagonal();
  return constraint;
}

}  // namespace mono3d
