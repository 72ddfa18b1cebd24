// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/match_alignment.h"

#include <Eigen/Core>

namespace mono3d::tracking {

std::optional<PatchPosition> AlignMatch(const View& a, const View& b, const FeatureMatch& match) {
  constexpr int kCoarseLevel = 4;          // 1.2^4 = 2.07, an octave
  constexpr double kMinCorrelation = 0.9;  // stricter than in flight: the patch is not warped
  if (a.octaves.empty() || b.octaves.empty()) return std::nullopt;
  const Feature& in_a = a.features[match.feature_a];
  const std::optional<Patch> patch =
      TakePatch(a.octaves, in_a.pixel, in_a.level >= kCoarseLevel ? 1 : 0);
  if (!patch) return std::nullopt;
  std::optional<PatchPosition> found =
      AlignPatch(*patch, Eigen::Matrix2d::Identity(), b.octaves, b.features[match.feature_b].pixel);
  if (!found || found->correlation < kMinCorrelation) return std::nullopt;
  return found;
}

}  // namespace mono3d::tracking
