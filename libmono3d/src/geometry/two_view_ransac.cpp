// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/two_view_ransac.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cstddef>
#include <functional>
#include <random>

#include "mono3d/geometry/fundamental.h"

namespace mono3d {
namespace {

constexpr double kChi2TwoDof = 5.991;  // 95 %
constexpr double kChi2OneDof = 3.841;
constexpr std::size_t kSetSize = 8;  // for both models, so that their chances are the same

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

std::optional<TwoViewModel> Ransac(std::span<const PointPair> pairs,
                                   const TwoViewRansacOptions& options, Fit fit,
                                   const Scorer& score) {
  if (pairs.size() < kSetSize) return std::nullopt;
  std::mt19937 random(static_cast<std::mt19937::result_type>(options.seed));
  std::optional<TwoViewModel> best;
  for (int round = 0; round < options.num_rounds; ++round) {
    std::array<std::size_t, kSetSize> chosen{};
    for (std::size_t i = 0; i < kSetSize; ++i) {
      // Plain remainder: std::uniform_int_distribution differs between standard libraries.
      bool is_new = false;
      while (!is_new) {
        chosen[i] = random() % pairs.size();
        is_new = true;
        for (std::size_t j = 0; j < i; ++j) is_new = is_new && chosen[j] != chosen[i];
      }
    }
    std::array<PointPair, kSetSize> set;
    for (std::size_t i = 0; i < kSetSize; ++i) set[i] = pairs[chosen[i]];
    const std::optional<Eigen::Matrix3d> matrix = fit(set);
    if (!matrix) continue;
    TwoViewModel model = score(*matrix);
    if (!best || model.score > best->score) best = std::move(model);
  }
  if (best) Refine(pairs, fit, score, *best);
  return best;
}

}  // namespace

std::optional<TwoViewModel> EstimateHomography(std::span<const PointPair> pairs,
                                               const TwoViewRansacOptions& options) {
  return Ransac(pairs, options, FitHomography, [&](const Eigen::Matrix3d& H) {
    return ScoreHomography(H, pairs, options.sigma_px);
  });
}

std::optional<TwoViewModel> EstimateFundamental(std::span<const PointPair> pairs,
                                                const TwoViewRansacOptions& options) {
  return Ransac(pairs, options, FitFundamental, [&](const Eigen::Matrix3d& F) {
    return ScoreFundamental(F, pairs, options.sigma_px);
  });
}

}  // namespace mono3d
