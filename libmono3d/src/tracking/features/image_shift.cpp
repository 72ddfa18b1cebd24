// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/image_shift.h"

#include <cmath>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgproc.hpp>

#include "core/clamped_int.h"
#include "tracking/features/descriptor.h"
#include "tracking/features/matching.h"

namespace mono3d::tracking {
namespace {

// More say the same at more expense.
constexpr std::size_t kMaxVoters = 500;
constexpr int kBinsPerWidth = 24;  // three make an eighth of the width
constexpr int kPeakBins = 3;       // side of a peak: shifts differ with depth and perspective

std::vector<std::size_t> Voters(const View& a, const std::vector<char>& use_a, int max_level) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    if (use_a[i] != 0 && a.features[i].level <= max_level) all.push_back(i);
  }
  if (all.size() <= kMaxVoters) return all;
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < kMaxVoters; ++i) some.push_back(all[i * all.size() / kMaxVoters]);
  return some;
}

// The shift to the most similar feature of b about the same level, for each that has a close one.
std::vector<Eigen::Vector2d> Votes(const View& a, const std::vector<std::size_t>& voters,
                                   const View& b) {
  std::vector<Eigen::Vector2d> votes;
  for (const std::size_t i : voters) {
    const Feature& feature = a.features[i];
    const Feature* best = nullptr;
    int best_distance = kCloseDistance + 1;
    for (const Feature& other : b.features) {
      if (std::abs(other.level - feature.level) > 1) continue;
      const int distance = Distance(feature.descriptor, other.descriptor);
      if (distance >= best_distance) continue;
      best_distance = distance;
      best = &other;
    }
    if (best != nullptr) votes.emplace_back(best->pixel - feature.pixel);
  }
  return votes;
}

// Votes of wrong matches scatter over all shifts, most of them small ones: at its densest, of two
// images unrelated, one over the area of the image. A peak must exceed that by five deviations
// (Poisson).
bool IsSignificant(double num_votes, std::size_t num_all, double area_share) {
  constexpr double kMinVotes = 15;  // as for a place of the index
  constexpr double kMinSigmas = 5;
  const double by_chance = static_cast<double>(num_all) * area_share;
  return num_votes >= kMinVotes && num_votes > by_chance + kMinSigmas * std::sqrt(by_chance);
}

}  // namespace

std::optional<Eigen::Vector2d> CommonShift(const View& a, const std::vector<char>& use_a,
                                           const View& b, int max_level) {
  const CameraModel& camera = b.frame.camera;
  const double bin_px = static_cast<double>(camera.width) / kBinsPerWidth;
  const std::vector<Eigen::Vector2d> votes = Votes(a, Voters(a, use_a, max_level), b);
  const int half_rows = static_cast<int>(std::ceil(camera.height / bin_px));
  cv::Mat histogram = cv::Mat::zeros(2 * half_rows + 1, 2 * kBinsPerWidth + 1, CV_32FC1);
  for (const Eigen::Vector2d& vote : votes) {
    // In an image of few pixels the border that features may lie beyond is a bin and more.
    ++histogram.at<float>(
        half_rows + ClampedInt(std::round(vote.y() / bin_px), -half_rows, half_rows),
        kBinsPerWidth + ClampedInt(std::round(vote.x() / bin_px), -kBinsPerWidth, kBinsPerWidth));
  }
  cv::boxFilter(histogram, histogram, CV_32F, {kPeakBins, kPeakBins}, {-1, -1}, false,
                cv::BORDER_CONSTANT);
  double num_votes = 0;
  cv::Point peak;
  cv::minMaxLoc(histogram, nullptr, &num_votes, nullptr, &peak);
  const double side_px = kPeakBins * bin_px;
  const double area_share = side_px * side_px / (static_cast<double>(camera.width) * camera.height);
  if (!IsSignificant(num_votes, votes.size(), area_share)) return std::nullopt;
  const Eigen::Vector2d centre(bin_px * (peak.x - kBinsPerWidth), bin_px * (peak.y - half_rows));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0;
  for (const Eigen::Vector2d& vote : votes) {
    if ((vote - centre).cwiseAbs().maxCoeff() > 0.5 * side_px) continue;
    sum += vote;
    ++count;
  }
  return sum / count;
}

}  // namespace mono3d::tracking
