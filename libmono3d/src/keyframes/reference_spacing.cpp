// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/reference_spacing.h"

#include <algorithm>
#include <optional>
#include <span>

namespace mono3d {

void ReferenceSpacing::Add(const View& reference) {
  references_.push_back({reference});
  references_.back().view.ReleaseImageAndPoints();
}

void ReferenceSpacing::NoteNoDepth(std::int64_t reference_id) {
  for (Reference& reference : references_) {
    if (reference.view.id() == reference_id) reference.has_depth = false;
  }
}

bool ReferenceSpacing::HasLike(const View& view, const KeyframePoses& poses) const {
  return std::ranges::any_of(references_, [&](const Reference& reference) {
    return AreInOneMap(view, reference.view, poses) &&
           BaselineRatio(view, reference.view, poses) < min_baseline_ratio_ &&
           Compare(view, reference.view, poses).sharp_share > 1 - min_new_share_;
  });
}

double ReferenceSpacing::NewShare(const View& view, const KeyframePoses& poses) const {
  const std::span<const Eigen::Vector3d> points = view.points();
  if (points.empty()) return 0;
  std::vector<bool> is_known(points.size(), false);
  for (const Reference& reference : references_) {
    if (!reference.has_depth || !AreInOneMap(view, reference.view, poses)) continue;
    const Reprojection reprojection(view, reference.view, poses);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (is_known[i]) continue;
      const std::optional<double> scale = reprojection.Scale(points[i]);
      is_known[i] = scale && *scale >= kMinSharpScale;
    }
  }
  const auto num_new = std::ranges::count(is_known, false);
  return static_cast<double>(num_new) / static_cast<double>(points.size());
}

}  // namespace mono3d
