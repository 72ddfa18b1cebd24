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
// The rest of what is matched around a region may belong to what stands before it.
constexpr double kMinInlierShare = 0.6;
constexpr std::size_t kMinInliers = 12;
// Cells around a region in which samples are looked for: what is matched nearest to it may have
// the depth of its neighbour, by half the census window.
constexpr int kReach = 3;
// Planes of the sweep.
constexpr double kTolerance = 1;
constexpr double kLeastSigma = 0.25;
// Cells of which the errors are alike, as windows overlap.
constexpr double kCellsPerError = 9;
// Three of 60 % inliers: all tries miss with a probability below 1e-5.
constexpr int kNumTries = 50;
constexpr std::size_t kMostSamples = 400;  // that a region is judged by
// Of a region that has to have an estimate for its shape to be seen, and the median difference from
// a smooth surface, in planes of the sweep: grass on waves of the ground has 0.3 to 0.5, what is
// matched by chance on a bare roof 1.2 to 2.
constexpr double kMinSeenShare = 0.25;
constexpr double kMaxSeenDifference = 0.75;
constexpr int kNumReweightings = 8;
constexpr double kMostConfidence = 0.125;  // as inference.comp has it

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
std::optional<Eigen::Vector3d> BestHypothesis(const std::vector<Sample>& samples) {
  std::minstd_rand random(1);
  const std::size_t stride = StrideOf(samples.size());
  std::optional<Eigen::Vector3d> best;
  double least = 0;
  for (int i = 0; i < kNumTries; ++i) {
    const std::optional<Eigen::Vector3d> slopes = ThroughThree(samples, random);
    if (!slopes) continue;
    double cost = 0;
    for (std::size_t k = 0; k < samples.size(); k += stride) {
      const double residual = Residual(samples[k], *slopes);
      cost += std::min(residual * residual, kTolerance * kTolerance);
    }
    if (!best || cost < least) {
      best = slopes;
      least = cost;
    }
  }
  return best;
}

// By least squares of the samples near `start`; none where too few are.
std::optional<Plane> Fit(const std::vector<Sample>& samples, const Eigen::Vector3d& start) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double sum_of_squares = 0;
  std::size_t num_inliers = 0;
  for (const Sample& sample : samples) {
    const double residual = Residual(sample, start);
    if (std::abs(residual) > kTolerance) continue;
    normal += sample.at * sample.at.transpose();
    right += residual * sample.at;
    sum_of_squares += residual * residual;
    ++num_inliers;
  }
  if (num_inliers < kMinInliers ||
      static_cast<double>(num_inliers) < kMinInlierShare * static_cast<double>(samples.size())) {
    return std::nullopt;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  if (!solver.isPositive() || solver.rcond() < 1e-12) return std::nullopt;
  const double sigma =
      std::max(kLeastSigma, std::sqrt(sum_of_squares / static_cast<double>(num_inliers)));
  return Plane{start + solver.solve(right),
               kCellsPerError * sigma * sigma * solver.solve(Eigen::Matrix3d::Identity())};
}

std::optional<Plane> FitRobustly(const std::vector<Sample>& samples) {
  if (samples.size() < kMinInliers) return std::nullopt;
  const std::optional<Eigen::Vector3d> start = BestHypothesis(samples);
  if (!start) return std::nullopt;
  const std::optional<Plane> first = Fit(samples, *start);
  return first ? Fit(samples, first->slopes) : std::nullopt;
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
  RegionCells(const cv::Mat& bgr, const cv::Mat& depth, const cv::Mat& unfiltered,
              const cv::Mat& sky, double step)
      : unfiltered_(unfiltered),
        step_(step),
        colours_(MeansOfCells(bgr)),
        middle_(0.5 * bgr.cols, 0.5 * bgr.rows) {
    cv::Mat inverse_depth(depth.size(), CV_32FC1, cv::Scalar(0));
    for (int y = 0; y < depth.rows; ++y) {
      const auto* from = depth.ptr<float>(y);
      auto* const to = inverse_depth.ptr<float>(y);
      for (int x = 0; x < depth.cols; ++x) {
        if (from[x] > 0) to[x] = static_cast<float>(1 / (from[x] * step));
      }
    }
    shares_ = MeansOfCells((depth > 0) / 255 * 128);  // in 1/128
    inverse_depths_ = MeansOfCells(inverse_depth);
    is_bare_ = (shares_ < 64) & (sky == 0);
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
    const cv::Rect pixels = cv::Rect(cell * kImageCell_px, cv::Size(kImageCell_px, kImageCell_px)) &
                            cv::Rect({}, unfiltered_.size());
    const cv::Mat values = unfiltered_(pixels);
    const int num = cv::countNonZero(values > 0);
    if (2 * num < pixels.area()) return std::nullopt;
    return cv::sum(values)[0] / (num * step_);
  }

 private:
  const cv::Mat& unfiltered_;
  double step_;
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

}  // namespace

cv::Mat FindPlanarRegions(const cv::Mat& bgr, const cv::Mat& depth, const cv::Mat& unfiltered,
                          const cv::Mat& sky, double step) {
  cv::Mat found(sky.size(), CV_32FC4, cv::Scalar(0, 0, 0, 0));
  found.setTo(cv::Scalar(0, 0, 0, -1), sky);
  RegionCells cells(bgr, depth, unfiltered, sky, step);
  const auto min_cells =
      static_cast<std::size_t>(kMinRegionShare * static_cast<double>(sky.total()));
  for (int y = 0; y < sky.rows; ++y) {
    for (int x = 0; x < sky.cols; ++x) {
      if (!cells.IsBare({x, y})) continue;
      const std::vector<cv::Point> region = cells.TakeRegion({x, y});
      if (region.size() < min_cells || IsSeen(region, cells)) continue;
      const std::optional<Plane> plane = FitRobustly(cells.SamplesAround(region));
      if (!plane) continue;
      for (const cv::Point& cell : region) {
        const Eigen::Vector3d at = cells.MiddleOf(cell);
        const double inverse_depth = plane->slopes.dot(at);
        if (inverse_depth <= 0) continue;
        const double variance = at.dot(plane->covariance * at);
        const Eigen::Vector3d values =
            step * Eigen::Vector3d(inverse_depth, plane->slopes.x(), plane->slopes.y());
        found.at<cv::Vec4f>(cell) = {float(values.x()), float(values.y()), float(values.z()),
                                     float(kMostConfidence / (1 + variance))};
      }
    }
  }
  return found;
}

}  // namespace mono3d
