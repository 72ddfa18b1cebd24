// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/planar_regions.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "depth/image_cells.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// Grey levels from one cell to the next, in each channel: shading has less, edges have more.
constexpr int kMaxColourStep = 5;
constexpr double kMinRegionShare =
    0.001;  // of the image: smaller regions are completed as well without
constexpr std::size_t kMinInliers = 12;
// Cells around a region in which samples are looked for: what is matched nearest to it may have
// the depth of its neighbour, by half the census window.
constexpr int kReach = 3;
// Planes of the sweep.
constexpr double kLeastSigma = 0.25;
// Cells of which the errors are alike, as windows overlap.
constexpr double kCellsPerError = 9;
constexpr std::size_t kMostSamples = 400;  // that a region is judged by
// Of a region that has to have an estimate for its shape to be seen, and the median difference from
// a smooth surface, in planes of the sweep: grass on waves of the ground has 0.3 to 0.5, what is
// matched by chance on a bare roof 1.2 to 2.
constexpr double kMinSeenShare = 0.25;
constexpr double kMaxSeenDifference = 0.75;
constexpr int kNumReweightings = 8;
// Of winners without any meaning 7 of 16 are within three planes of the right one, if that is among
// the 16 that are tried at a pixel.
constexpr double kMinAgreeingShare = 0.5;
// Of the share that any plane parallel to it has: the best one lies a plane or two beside it.
constexpr double kMinShareOfBest = 0.9;
constexpr double kMinWinnerShare = 0.9;    // of the pixels, that have one
constexpr int kMostDifference = 80;        // planes; farther ones are with none
constexpr double kMostConfidence = 0.125;  // as inference.comp has it

// Of what was matched around a region, which part has to lie on its plane.
struct Limits {
  double tolerance = 0;  // planes of the sweep
  // What counts against a plane for a sample that stands before it, of what one behind it counts.
  double share_before = 0;
  double min_inlier_share = 0;
  double max_share_behind = 0;
  int num_tries = 0;  // of three samples
};
// The rest may belong to what stands before the region. All tries miss with a probability below
// 1e-5.
constexpr Limits kMostOnIt = {1, 1, 0.6, 1, 50};
// The rest stands before it, but for chance matches. With 30 % all tries miss in 1 % of cases.
constexpr Limits kOthersBeforeIt = {2, 0.5, 0.3, 0.15, 170};

// In the middle of a cell.
struct Sample {
  Eigen::Vector3d at;        // x, y in px from the middle of the image, 1
  double inverse_depth = 0;  // planes of the sweep
};

// Inverse depth is affine in the pixel.
struct Plane {
  Eigen::Vector3d slopes;  // times Sample::at
  Eigen::Matrix3d covariance;
};

// Every so many, no more than kMostSamples are taken.
std::size_t StrideOf(std::size_t size) { return (size + kMostSamples - 1) / kMostSamples; }

double Residual(const Sample& sample, const Eigen::Vector3d& slopes) {
  return sample.inverse_depth - slopes.dot(sample.at);
}

std::optional<Eigen::Vector3d> ThroughThree(const std::vector<Sample>& samples,
                                            std::minstd_rand& random) {
  Eigen::Matrix3d at;
  Eigen::Vector3d inverse_depths;
  for (int i = 0; i < 3; ++i) {
    const Sample& sample = samples[random() % samples.size()];
    at.row(i) = sample.at.transpose();
    inverse_depths[i] = sample.inverse_depth;
  }
  // Twice the area of the triangle, px^2.
  if (std::abs(at.determinant()) < kImageCell_px * kImageCell_px) return std::nullopt;
  return at.inverse() * inverse_depths;
}

// Of the hypotheses that with the least sum of squares, cut at the tolerance (MSAC).
std::optional<Eigen::Vector3d> BestHypothesis(const std::vector<Sample>& samples,
                                              const Limits& limits) {
  const double most_behind = limits.tolerance * limits.tolerance;
  const double most_before = limits.share_before * most_behind;
  std::minstd_rand random(1);
  const std::size_t stride = StrideOf(samples.size());
  std::optional<Eigen::Vector3d> best;
  double least = 0;
  for (int i = 0; i < limits.num_tries; ++i) {
    const std::optional<Eigen::Vector3d> slopes = ThroughThree(samples, random);
    if (!slopes) continue;
    double cost = 0;
    for (std::size_t k = 0; k < samples.size(); k += stride) {
      const double residual = Residual(samples[k], *slopes);
      cost += std::min(residual * residual, residual > 0 ? most_before : most_behind);
    }
    if (!best || cost < least) {
      best = slopes;
      least = cost;
    }
  }
  return best;
}

// By least squares of the samples near `start`; none where too few are.
std::optional<Plane> Fit(const std::vector<Sample>& samples, const Eigen::Vector3d& start,
                         const Limits& limits) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double sum_of_squares = 0;
  std::size_t num_inliers = 0;
  std::size_t num_behind = 0;
  for (const Sample& sample : samples) {
    const double residual = Residual(sample, start);
    if (residual < -limits.tolerance) ++num_behind;
    if (std::abs(residual) > limits.tolerance) continue;
    normal += sample.at * sample.at.transpose();
    right += residual * sample.at;
    sum_of_squares += residual * residual;
    ++num_inliers;
  }
  const auto num = static_cast<double>(samples.size());
  if (num_inliers < kMinInliers ||
      static_cast<double>(num_inliers) < limits.min_inlier_share * num ||
      static_cast<double>(num_behind) > limits.max_share_behind * num) {
    return std::nullopt;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  if (!solver.isPositive() || solver.rcond() < 1e-12) return std::nullopt;
  const double sigma =
      std::max(kLeastSigma, std::sqrt(sum_of_squares / static_cast<double>(num_inliers)));
  return Plane{start + solver.solve(right),
               kCellsPerError * sigma * sigma * solver.solve(Eigen::Matrix3d::Identity())};
}

std::optional<Plane> FitRobustly(const std::vector<Sample>& samples, const Limits& limits) {
  if (samples.size() < kMinInliers) return std::nullopt;
  const std::optional<Eigen::Vector3d> start = BestHypothesis(samples, limits);
  if (!start) return std::nullopt;
  const std::optional<Plane> first = Fit(samples, *start, limits);
  return first ? Fit(samples, first->slopes, limits) : std::nullopt;
}

bool AreAlike(const cv::Vec3b& one, const cv::Vec3b& other) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(int(one[i]) - int(other[i])) > kMaxColourStep) return false;
  }
  return true;
}

// The image in cells.
class RegionCells {
 public:
  explicit RegionCells(const PlanarRegionsInput& input)
      : input_(input),
        colours_(MeansOfCells(input.bgr)),
        middle_(0.5 * input.bgr.cols, 0.5 * input.bgr.rows) {
    const cv::Mat& depth = input.depth;
    cv::Mat inverse_depth(depth.size(), CV_32FC1, cv::Scalar(0));
    for (int y = 0; y < depth.rows; ++y) {
      const auto* from = depth.ptr<float>(y);
      auto* const to = inverse_depth.ptr<float>(y);
      for (int x = 0; x < depth.cols; ++x) {
        if (from[x] > 0) to[x] = static_cast<float>(1 / (from[x] * input.step));
      }
    }
    shares_ = MeansOfCells((depth > 0) / 255 * 128);  // in 1/128
    inverse_depths_ = MeansOfCells(inverse_depth);
    is_bare_ = (shares_ < 64) & (input.sky == 0);
  }

  cv::Size size() const { return colours_.size(); }

  Eigen::Vector3d MiddleOf(const cv::Point& cell) const {
    constexpr double kMiddle = 0.5 * (kImageCell_px - 1);
    return {kImageCell_px * cell.x + kMiddle - middle_.x,
            kImageCell_px * cell.y + kMiddle - middle_.y, 1};
  }

  // Those without depth that are joined to `seed` by steps between colours that are alike. They are
  // not bare any more.
  std::vector<cv::Point> TakeRegion(const cv::Point& seed) {
    std::vector<cv::Point> region{seed};
    is_bare_.at<std::uint8_t>(seed) = 0;
    for (std::size_t i = 0; i < region.size(); ++i) {
      const cv::Point from = region[i];
      for (const cv::Point side :
           {cv::Point(-1, 0), cv::Point(1, 0), cv::Point(0, -1), cv::Point(0, 1)}) {
        const cv::Point to = from + side;
        if (!cv::Rect({}, size()).contains(to) || is_bare_.at<std::uint8_t>(to) == 0) continue;
        if (!AreAlike(colours_.at<cv::Vec3b>(from), colours_.at<cv::Vec3b>(to))) continue;
        is_bare_.at<std::uint8_t>(to) = 0;
        region.push_back(to);
      }
    }
    return region;
  }

  bool IsBare(const cv::Point& cell) const { return is_bare_.at<std::uint8_t>(cell) != 0; }

  // What was matched in a region and around it.
  std::vector<Sample> SamplesAround(const std::vector<cv::Point>& region) const {
    const cv::Rect around =
        (cv::boundingRect(region) + cv::Size(2 * kReach, 2 * kReach) - cv::Point(kReach, kReach)) &
        cv::Rect({}, size());
    cv::Mat mask(around.size(), CV_8UC1, cv::Scalar(0));
    for (const cv::Point& cell : region) mask.at<std::uint8_t>(cell - around.tl()) = 255;
    cv::dilate(mask, mask, cv::Mat::ones(2 * kReach + 1, 2 * kReach + 1, CV_8UC1));
    std::vector<Sample> samples;
    for (int y = 0; y < around.height; ++y) {
      for (int x = 0; x < around.width; ++x) {
        const cv::Point cell = cv::Point(x, y) + around.tl();
        const int share = shares_.at<std::uint8_t>(cell);
        if (mask.at<std::uint8_t>(y, x) == 0 || share < 32) continue;
        samples.push_back({MiddleOf(cell), inverse_depths_.at<float>(cell) * 128.0 / share});
      }
    }
    return samples;
  }

  // Of what the texture filter took away in a cell the mean inverse depth, in planes of the sweep;
  // none: not half of its pixels have one.
  std::optional<double> Unfiltered(const cv::Point& cell) const {
    const cv::Mat values = input_.unfiltered(PixelsOf(cell));
    const int num = cv::countNonZero(values > 0);
    if (2 * num < static_cast<int>(values.total())) return std::nullopt;
    return cv::sum(values)[0] / (num * input_.step);
  }

  // Of the pixels of a region that have a winner, the differences from a plane, in planes of the
  // sweep.
  std::vector<double> DifferencesOfWinners(const std::vector<cv::Point>& region,
                                           const Eigen::Vector3d& slopes) const {
    std::vector<double> differences;
    for (const cv::Point& cell : region) {
      const double expected = slopes.dot(MiddleOf(cell));
      const cv::Rect pixels = PixelsOf(cell);
      for (int y = pixels.y; y < pixels.br().y; y += 2) {
        for (int x = pixels.x; x < pixels.br().x; x += 2) {
          const float winner =
              input_.winners.at<float>(y >> input_.winner_level, x >> input_.winner_level);
          if (winner != 0) differences.push_back(std::abs(winner) / input_.step - expected);
        }
      }
    }
    return differences;
  }

  // Of the pixels that are looked at for them.
  int NumLookedAt(const std::vector<cv::Point>& region) const {
    int num = 0;
    for (const cv::Point& cell : region) {
      const cv::Rect pixels = PixelsOf(cell);
      num += (pixels.width + 1) / 2 * ((pixels.height + 1) / 2);
    }
    return num;
  }

 private:
  cv::Rect PixelsOf(const cv::Point& cell) const {
    return cv::Rect(cell * kImageCell_px, cv::Size(kImageCell_px, kImageCell_px)) &
           cv::Rect({}, input_.depth.size());
  }

  const PlanarRegionsInput& input_;
  cv::Mat colours_;
  cv::Mat shares_;          // of the pixels that have depth, in 1/128
  cv::Mat inverse_depths_;  // planes of the sweep; pixels without depth count as 0
  cv::Mat is_bare_;
  cv::Point2d middle_;  // of the image, px
};

// A surface of second order.
using Quadric = Eigen::Matrix<double, 6, 1>;

struct Unfiltered {
  Quadric at;
  double inverse_depth = 0;  // planes of the sweep
};

// Up to kMostSamples of them.
std::vector<Unfiltered> UnfilteredOf(const std::vector<cv::Point>& region,
                                     const RegionCells& cells) {
  const cv::Rect box = cv::boundingRect(region);
  const std::size_t stride = StrideOf(region.size());
  std::vector<Unfiltered> found;
  for (std::size_t i = 0; i < region.size(); i += stride) {
    const std::optional<double> inverse_depth = cells.Unfiltered(region[i]);
    if (!inverse_depth) continue;
    const double x = (region[i].x - box.x) / static_cast<double>(box.width);
    const double y = (region[i].y - box.y) / static_cast<double>(box.height);
    found.push_back({.at = {1, x, y, x * x, x * y, y * y}, .inverse_depth = *inverse_depth});
  }
  return found;
}

// Whether most of what the texture filter took away in a region lies on one smooth surface: then it
// is right, though not exact, and tells more of the shape of the region than its border does.
bool IsSeen(const std::vector<cv::Point>& region, const RegionCells& cells) {
  const std::vector<Unfiltered> found = UnfilteredOf(region, cells);
  const std::size_t stride = StrideOf(region.size());
  const std::size_t num_looked_at = (region.size() + stride - 1) / stride;
  if (static_cast<double>(found.size()) < kMinSeenShare * static_cast<double>(num_looked_at) ||
      found.size() < 2 * Quadric::RowsAtCompileTime) {
    return false;
  }
  // The least sum of absolute differences, by weighted least squares.
  std::vector<double> differences(found.size(), 1);
  for (int i = 0; i < kNumReweightings; ++i) {
    Eigen::Matrix<double, 6, 6> normal = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
    Quadric right = Quadric::Zero();
    for (std::size_t k = 0; k < found.size(); ++k) {
      const double weight = 1 / std::max(differences[k], kLeastSigma);
      normal += weight * found[k].at * found[k].at.transpose();
      right += weight * found[k].inverse_depth * found[k].at;
    }
    const Quadric quadric = normal.ldlt().solve(right);
    for (std::size_t k = 0; k < found.size(); ++k) {
      differences[k] = std::abs(found[k].inverse_depth - quadric.dot(found[k].at));
    }
  }
  return UpperMedian(std::move(differences)) <= kMaxSeenDifference;
}

// Whether winners of the sweep are on a plane of a region more often than by chance, and than on
// nearly all that are parallel to it.
bool WinnersAgree(const std::vector<cv::Point>& region, const RegionCells& cells,
                  const Eigen::Vector3d& slopes, int max_difference) {
  const std::vector<double> differences = cells.DifferencesOfWinners(region, slopes);
  if (static_cast<double>(differences.size()) < kMinWinnerShare * cells.NumLookedAt(region)) {
    return false;
  }
  std::vector<int> counts(2 * kMostDifference + 1, 0);
  for (const double difference : differences) {
    if (std::abs(difference) > kMostDifference) continue;
    ++counts[static_cast<std::size_t>(std::lround(difference) + kMostDifference)];
  }
  int on_it = 0;
  int most = 0;
  for (int offset = max_difference - kMostDifference; offset <= kMostDifference - max_difference;
       ++offset) {
    const auto first = counts.begin() + kMostDifference + offset - max_difference;
    const int num = std::accumulate(first, first + 2 * max_difference + 1, 0);
    if (offset == 0) on_it = num;
    most = std::max(most, num);
  }
  return on_it >= kMinAgreeingShare * static_cast<double>(differences.size()) &&
         on_it >= kMinShareOfBest * most;
}

struct PlaneOfRegion {
  Plane plane;
  bool is_believed = false;  // as a whole
};

std::optional<PlaneOfRegion> PlaneOf(const std::vector<cv::Point>& region, const RegionCells& cells,
                                     const PlanarRegionsInput& input) {
  const std::vector<Sample> samples = cells.SamplesAround(region);
  const auto agrees = [&](const Plane& plane) {
    return !input.winners.empty() &&
           WinnersAgree(region, cells, plane.slopes, input.max_difference);
  };
  if (const std::optional<Plane> plane = FitRobustly(samples, kMostOnIt)) {
    return PlaneOfRegion{*plane, agrees(*plane)};
  }
  const std::optional<Plane> behind = FitRobustly(samples, kOthersBeforeIt);
  if (behind && agrees(*behind)) return PlaneOfRegion{*behind, true};
  return std::nullopt;
}

}  // namespace

cv::Mat FindPlanarRegions(const PlanarRegionsInput& input) {
  const cv::Mat& sky = input.sky;
  cv::Mat found(sky.size(), CV_32FC4, cv::Scalar(0, 0, 0, 0));
  found.setTo(cv::Scalar(0, 0, 0, -1), sky);
  RegionCells cells(input);
  const auto min_cells =
      static_cast<std::size_t>(kMinRegionShare * static_cast<double>(sky.total()));
  for (int y = 0; y < sky.rows; ++y) {
    for (int x = 0; x < sky.cols; ++x) {
      if (!cells.IsBare({x, y})) continue;
      const std::vector<cv::Point> region = cells.TakeRegion({x, y});
      if (region.size() < min_cells || IsSeen(region, cells)) continue;
      const std::optional<PlaneOfRegion> found_plane = PlaneOf(region, cells, input);
      if (!found_plane) continue;
      const Plane& plane = found_plane->plane;
      for (const cv::Point& cell : region) {
        const Eigen::Vector3d at = cells.MiddleOf(cell);
        const double inverse_depth = plane.slopes.dot(at);
        if (inverse_depth <= 0) continue;
        const double variance = at.dot(plane.covariance * at);
        const Eigen::Vector3d values =
            input.step * Eigen::Vector3d(inverse_depth, plane.slopes.x(), plane.slopes.y());
        const double confidence = kMostConfidence / (1 + variance);
        found.at<cv::Vec4f>(cell) = {float(values.x()), float(values.y()), float(values.z()),
                                     float(found_plane->is_believed ? 1 + confidence : confidence)};
      }
    }
  }
  return found;
}

}  // namespace mono3d
