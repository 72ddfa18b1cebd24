// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cstddef>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/geometry/two_view_ransac.h"
#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_matching.h"

namespace mono3d {
namespace {

// Large structures are enough.
constexpr int kNumFeatures = 600;
constexpr int kMaxSide_px = 480;

double Smaller(const tracking::PhotoFeatures& a, const tracking::PhotoFeatures& b) {
  return static_cast<double>(std::min(a.size(), b.size()));
}

// The share of a picture's features that are found once it has been turned and made smaller a
// little, within so many pixels: what can be had of it at most. Windows of a town look like each
// other, and are rarely found again.
double ShareFoundInItself(const cv::Mat& bgr, const tracking::PhotoFeatures& features,
                          double max_error_px) {
  constexpr double kTurn_deg = 3;
  constexpr double kScale = 0.95;
  const cv::Point2f middle(0.5F * static_cast<float>(bgr.cols),
                           0.5F * static_cast<float>(bgr.rows));
  const cv::Matx23d to_changed = cv::getRotationMatrix2D(middle, kTurn_deg, kScale);
  cv::Mat changed;
  cv::warpAffine(bgr, changed, to_changed, bgr.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  const auto of_changed = tracking::ExtractPhotoFeatures(changed, kNumFeatures, kMaxSide_px);
  int num_found = 0;
  for (const tracking::FeatureMatch& match : tracking::MatchPhotoFeatures(
           features, of_changed, std::numeric_limits<std::size_t>::max())) {
    const Eigen::Vector2d& from = features.pixels[match.feature_a];
    const cv::Vec2d to = to_changed * cv::Vec3d(from.x(), from.y(), 1);
    const Eigen::Vector2d error =
        of_changed.pixels[match.feature_b] - Eigen::Vector2d(to[0], to[1]);
    if (error.norm() < max_error_px) ++num_found;
  }
  return num_found / std::max(1., Smaller(features, of_changed));
}

// Has the camera hardly moved? Noise alone makes features unlike from one frame to the next.
bool IsStep(const std::vector<PointPair>& pairs, const TwoViewModel& F, double longer_side_px) {
  constexpr int kMinInliers = 30;
  constexpr double kMaxStep = 0.03;  // of the longer side: photographs 4 degrees apart move by more
  if (F.num_inliers < kMinInliers) return false;
  std::vector<float> steps_px;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (F.is_inlier[i] == 0) continue;
    steps_px.push_back(static_cast<float>((pairs[i].b - pairs[i].a).norm()));
  }
  return UpperMedianOrZero(std::move(steps_px)) < kMaxStep * longer_side_px;
}

}  // namespace

std::optional<double> ContinuityOf(const cv::Mat& bgr, const cv::Mat& next_bgr) {
  constexpr double kMinFeatures = 50;
  constexpr double kMinShare = 0.1;  // that most pictures have by far, 0.35 to 0.7
  const auto a = tracking::ExtractPhotoFeatures(bgr, kNumFeatures, kMaxSide_px);
  const auto b = tracking::ExtractPhotoFeatures(next_bgr, kNumFeatures, kMaxSide_px);
  const double num_features = Smaller(a, b);
  if (num_features < kMinFeatures) return std::nullopt;
  std::vector<PointPair> pairs;
  for (const tracking::FeatureMatch& match :
       tracking::MatchPhotoFeatures(a, b, std::numeric_limits<std::size_t>::max())) {
    pairs.push_back({a.pixels[match.feature_a], b.pixels[match.feature_b]});
  }
  TwoViewRansacOptions ransac;
  ransac.sigma_px = std::max(1.0, static_cast<double>(bgr.cols) / kMaxSide_px);
  const std::optional<TwoViewModel> F = EstimateFundamental(pairs, ransac);
  const double longer_side_px = std::max(bgr.cols, bgr.rows);
  // First, since what can be had of a picture at most takes its features once more.
  if (F && IsStep(pairs, *F, longer_side_px)) return 1;
  const double at_most = ShareFoundInItself(bgr, a, 3 * ransac.sigma_px);
  if (at_most < kMinShare) return std::nullopt;
  if (!F) return 0;
  return std::min(1., F->num_inliers / (at_most * num_features));
}

}  // namespace mono3d
