// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "mono3d/geometry/two_view_ransac.h"
#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_matching.h"

namespace mono3d {

std::optional<double> ContinuityOf(const cv::Mat& bgr, const cv::Mat& next_bgr) {
  // Large structures are enough.
  constexpr int kNumFeatures = 600;
  constexpr int kMaxSide_px = 480;
  constexpr std::size_t kMinFeatures = 50;
  const auto a = tracking::ExtractPhotoFeatures(bgr, kNumFeatures, kMaxSide_px);
  const auto b = tracking::ExtractPhotoFeatures(next_bgr, kNumFeatures, kMaxSide_px);
  const std::size_t num_features = std::min(a.size(), b.size());
  if (num_features < kMinFeatures) return std::nullopt;
  std::vector<PointPair> pairs;
  for (const tracking::FeatureMatch& match :
       tracking::MatchPhotoFeatures(a, b, std::numeric_limits<std::size_t>::max())) {
    pairs.push_back({a.pixels[match.feature_a], b.pixels[match.feature_b]});
  }
  TwoViewRansacOptions ransac;
  ransac.sigma_px = std::max(1.0, static_cast<double>(bgr.cols) / kMaxSide_px);
  const std::optional<TwoViewModel> F = EstimateFundamental(pairs, ransac);
  return F ? F->num_inliers / static_cast<double>(num_features) : 0;
}

}  // namespace mono3d
