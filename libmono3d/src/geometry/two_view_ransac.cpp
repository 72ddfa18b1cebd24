// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/two_view_ransac.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstddef>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <utility>
#include <vector>

#include "mono3d/geometry/fundamental.h"

namespace mono3d {
namespace {

constexpr double kChi2TwoDof = 5.991;  // 95 %
constexpr double kChi2OneDof = 3.841;
constexpr std::size_t kMinPairs = 8;  // that FitFundamental needs

using Fit = std::optional<Eigen::Matrix3d> (*)(std::span<const PointPair>);
using Scorer = std::function<TwoViewModel(const Eigen::Matrix3d&)>;

// Adds one direction of one pair; false when it is an outlier.
bool AddScore(double chi2, double limit, TwoViewModel& model) {
  if (!(chi2 <= limit)) return false;
  model.score += kChi2TwoDof - chi2;
  return true;
}

void Mark(bool is_inlier, TwoViewModel& model) {
  model.is_inlier.push_back(is_inlier ? 1 : 0);
  model.num_inliers += is_inlier ? 1 : 0;
}

TwoViewModel ScoreHomography(const Eigen::Matrix3d& H, std::span<const PointPair> pairs,
                             double sigma_px) {
  TwoViewModel model;
  model.matrix = H;
  model.is_inlier.reserve(pairs.size());
  const Eigen::Matrix3d H_inverse = H.inverse();
  const double weight = 1 / (sigma_px * sigma_px);
  for (const PointPair& pair : pairs) {
    const Eigen::Vector3d b = H * pair.a.homogeneous();
    const Eigen::Vector3d a = H_inverse * pair.b.homogeneous();
    const double error_b = (b.head<2>() / b.z() - pair.b).squaredNorm();
    const double error_a = (a.head<2>() / a.z() - pair.a).squaredNorm();
    const bool b_fits = AddScore(error_b * weight, kChi2TwoDof, model);
    const bool a_fits = AddScore(error_a * weight, kChi2TwoDof, model);
    Mark(a_fits && b_fits, model);
  }
  return model;
}

TwoViewModel ScoreFundamental(const Eigen::Matrix3d& F, std::span<const PointPair> pairs,
                              double sigma_px) {
  TwoViewModel model;
  model.matrix = F;
  model.is_inlier.reserve(pairs.size());
  const Eigen::Matrix3d F_transposed = F.transpose();
  const double weight = 1 / (sigma_px * sigma_px);
  for (const PointPair& pair : pairs) {
    const double error_b = SquaredEpipolarDistance(F, pair.a, pair.b);
    const double error_a = SquaredEpipolarDistance(F_transposed, pair.b, pair.a);
    const bool b_fits = AddScore(error_b * weight, kChi2OneDof, model);
    const bool a_fits = AddScore(error_a * weight, kChi2OneDof, model);
    Mark(a_fits && b_fits, model);
  }
  return model;
}

// Refits to all inliers as long as that raises the score.
void Refine(std::span<const PointPair> pairs, Fit fit, const Scorer& score, TwoViewModel& best) {
  constexpr int kMaxRefits = 5;
  for (int i = 0; i < kMaxRefits; ++i) {
    std::vector<PointPair> inliers;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (best.is_inlier[k] != 0) inliers.push_back(pairs[k]);
    }
    const std::optional<Eigen::Matrix3d> matrix = fit(inliers);
    if (!matrix) return;
    TwoViewModel refined = score(*matrix);
    if (refined.score <= best.score) return;
    best = std::move(refined);
  }
}

struct Points {
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;
};

Points Split(std::span<const PointPair> pairs) {
  Points points;
  for (const PointPair& pair : pairs) {
    points.a.emplace_back(pair.a.x(), pair.a.y());
    points.b.emplace_back(pair.b.x(), pair.b.y());
  }
  return points;
}

// One thread and a seed of its own make it reproducible.
cv::UsacParams Params(const TwoViewRansacOptions& options, double threshold_chi2) {
  cv::UsacParams params;
  params.confidence = 0.999;
  params.isParallel = false;
  params.loIterations = 5;
  params.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  params.loSampleSize = 14;  // twice that of a fundamental matrix (Chum, Matas, Kittler 2003)
  params.maxIterations = options.max_rounds;
  params.randomGeneratorState = options.seed;
  params.sampler = cv::SAMPLING_UNIFORM;
  params.score = cv::SCORE_METHOD_MSAC;
  params.threshold = std::sqrt(threshold_chi2) * options.sigma_px;
  return params;
}

// What the search found, by our own score.
std::optional<TwoViewModel> Finish(const cv::Mat& found, std::span<const PointPair> pairs, Fit fit,
                                   const Scorer& score) {
  if (found.rows != 3 || found.cols != 3) return std::nullopt;  // empty: nothing was found
  Eigen::Matrix3d matrix;
  cv::cv2eigen(found, matrix);
  if (!matrix.allFinite()) return std::nullopt;
  TwoViewModel model = score(matrix);
  Refine(pairs, fit, score, model);
  return model;
}

}  // namespace

std::optional<TwoViewModel> EstimateHomography(std::span<const PointPair> pairs,
                                               const TwoViewRansacOptions& options) {
  if (pairs.size() < kMinPairs) return std::nullopt;
  const Points points = Split(pairs);
  cv::Mat mask;
  const cv::Mat H = cv::findHomography(points.a, points.b, mask, Params(options, kChi2TwoDof));
  return Finish(H, pairs, FitHomography, [&](const Eigen::Matrix3d& matrix) {
    return ScoreHomography(matrix, pairs, options.sigma_px);
  });
}

std::optional<TwoViewModel> EstimateFundamental(std::span<const PointPair> pairs,
                                                const TwoViewRansacOptions& options) {
  if (pairs.size() < kMinPairs) return std::nullopt;
  const Points points = Split(pairs);
  cv::Mat mask;
  const cv::Mat F = cv::findFundamentalMat(points.a, points.b, mask, Params(options, kChi2OneDof));
  return Finish(F, pairs, FitFundamental, [&](const Eigen::Matrix3d& matrix) {
    return ScoreFundamental(matrix, pairs, options.sigma_px);
  });
}

}  // namespace mono3d
