// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration_constraint.h"

#include <algorithm>
#include <vector>

#include "fusion/model_parts.h"
#include "fusion/surfel.h"

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

std::optional<std::size_t> AnchorOf(std::span<const std::uint32_t> blocks,
                                    std::span<const FusedView> views,
                                    std::span<const std::uint32_t> first_slots) {
  std::vector<std::uint32_t> num_blocks(views.size());
  for (const std::uint32_t block : blocks) {
    const std::size_t view = ViewOfSlot(first_slots, block * kSurfelsPerBlock);
    if (view < views.size()) ++num_blocks[view];
  }
  const auto most = std::max_element(num_blocks.begin(), num_blocks.end());
  if (most == num_blocks.end() || *most == 0) return std::nullopt;
  return static_cast<std::size_t>(most - num_blocks.begin());
}

KeyframeConstraint MakeConstraint(std::int64_t keyframe_id, const Similarity& S_world_kf,
                                  const Matrix7d& information, const FusedView& anchor) {
  const Pose in_world = S_world_kf.pose().Inverse() * anchor.S_world_kf.pose();
  const double anchor_scale = anchor.S_world_kf.scale();
  KeyframeConstraint constraint;
  constraint.id = keyframe_id;
  constraint.anchor_id = anchor.keyframe_id;
  constraint.T_cam_anchor = Pose(in_world.rotation(), in_world.translation() / anchor_scale);
  constraint.scale = S_world_kf.scale() / anchor_scale;
  Vector7d unit = Vector7d::Ones();
  unit.segment<3>(3).setConstant(anchor_scale);
  constraint.information = unit.asDiagonal() * information * unit.asDiagonal();
  return constraint;
}

}  // namespace mono3d
