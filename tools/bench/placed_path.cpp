// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/placed_path.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d::tools {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

constexpr std::size_t kFewest = 3;

struct Pairs {
  Points placed;
  Points truth;
};

Pairs PairsOf(std::span<const StampedPose> placed, std::span<const StampedPose> truth) {
  constexpr double kSameTime_s = 1e-3;
  Pairs pairs;
  for (const StampedPose& pose : placed) {
    const auto at = std::ranges::lower_bound(truth, pose.timestamp_s - kSameTime_s, {},
                                             &StampedPose::timestamp_s);
    if (at == truth.end() || at->timestamp_s > pose.timestamp_s + kSameTime_s) continue;
    pairs.placed.push_back(pose.T_world_cam.translation());
    pairs.truth.push_back(at->T_world_cam.translation());
  }
  if (pairs.placed.size() < kFewest)
    throw Error("fewer than three poses are of a time of the truth");
  return pairs;
}

Vector3d MiddleOf(const Points& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

// The turn about the vertical that the placed path has against the true one.
double HeadingOf(const Pairs& pairs) {
  const Vector3d placed_m = MiddleOf(pairs.placed);
  const Vector3d truth_m = MiddleOf(pairs.truth);
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    const Vector3d placed = pairs.placed[i] - placed_m;
    const Vector3d truth = pairs.truth[i] - truth_m;
    sum += std::complex(placed.x(), placed.y()) * std::complex(truth.x(), -truth.y());
  }
  return std::arg(sum);
}

// Squared distances after the best similarity.
std::vector<double> SquaresOf(const Points& placed, const Points& truth) {
  const Similarity S_truth_placed = FitSimilarity(placed, truth);
  std::vector<double> squares;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    squares.push_back((S_truth_placed * placed[i] - truth[i]).squaredNorm());
  }
  return squares;
}

double LocalError(const Pairs& pairs, double stretch_m) {
  double sum = 0;
  std::size_t num = 0;
  Pairs stretch;
  double way_m = 0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    stretch.placed.push_back(pairs.placed[i]);
    stretch.truth.push_back(pairs.truth[i]);
    if (i > 0) way_m += (pairs.truth[i] - pairs.truth[i - 1]).norm();
    if (way_m < stretch_m) continue;
    if (stretch.truth.size() >= kFewest) {
      for (const double square : SquaresOf(stretch.placed, stretch.truth)) sum += square;
      num += stretch.truth.size();
    }
    stretch = {};
    way_m = 0;
  }
  return num == 0 ? 0 : std::sqrt(sum / static_cast<double>(num));
}

}  // namespace

PlacedPathError ComparePlacedPath(std::span<const StampedPose> placed,
                                  std::span<const StampedPose> truth, double stretch_m) {
  const Pairs pairs = PairsOf(placed, truth);
  PlacedPathError error;
  error.log_scale = -std::log(FitSimilarity(pairs.placed, pairs.truth).scale());
  error.heading_rad = HeadingOf(pairs);
  error.middle_m = MiddleOf(pairs.placed) - MiddleOf(pairs.truth);
  double sum = 0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    sum += (pairs.placed[i] - pairs.truth[i]).squaredNorm();
    if (i > 0) error.length_m += (pairs.truth[i] - pairs.truth[i - 1]).norm();
  }
  error.rms_m = std::sqrt(sum / static_cast<double>(pairs.truth.size()));
  error.largest_m = std::sqrt(std::ranges::max(SquaresOf(pairs.placed, pairs.truth)));
  error.local_m = LocalError(pairs, stretch_m);
  return error;
}

}  // namespace mono3d::tools
