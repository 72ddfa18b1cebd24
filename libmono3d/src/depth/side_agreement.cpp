// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/side_agreement.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace mono3d {
namespace {

constexpr int kNumPixels = 640;    // that are sampled
constexpr int kMinNumPixels = 25;  // fewer lie next to each other and are no independent samples
// Windows with a smaller difference show the same point. Four fifths of the largest cost of an
// estimate, 46 of 124 (WinnerTakesAllOptions); resampling alone makes sharp images differ in up to
// a quarter of the bits.
constexpr double kMaxSureDifference = 0.3;
// On a scale from independent noise, 0, to independent images, 1. Measured: up to 0.45 in videos
// and up to 0.65 for photographs among trees, because the depth is fitted to the noise of the
// reference as well; 0.95 for unrelated images.
constexpr double kMaxIndependence = 0.75;
constexpr int kRadiusX = 4;  // of the census window, 9x7
constexpr int kRadiusY = 3;

bool HasWindow(const cv::Mat& grey, int x, int y) {
  return x >= kRadiusX && y >= kRadiusY && x < grey.cols - kRadiusX && y < grey.rows - kRadiusY;
}

// Requires HasWindow.
std::uint64_t Census(const cv::Mat& grey, int x, int y) {
  const std::uint8_t centre = grey.at<std::uint8_t>(y, x);
  std::uint64_t bits = 0;
  for (int dy = -kRadiusY; dy <= kRadiusY; ++dy) {
    const std::uint8_t* row = grey.ptr<std::uint8_t>(y + dy) + x;
    for (int dx = -kRadiusX; dx <= kRadiusX; ++dx) bits = 2 * bits + (row[dx] < centre ? 1 : 0);
  }
  return bits;
}

// The same around a point of another image, of places that its window there has: `jacobian` is how
// the point moves with the pixel of the reference. Between pixels linear. Of a place outside the
// image the nearest one inside.
std::uint64_t WarpedCensus(const cv::Mat& grey, const Eigen::Vector2d& point,
                           const Eigen::Matrix2d& jacobian) {
  const auto at = [&](double dx, double dy) {
    const Eigen::Vector2d limit(grey.cols - 1, grey.rows - 1);
    const Eigen::Array2d place =
        (point + jacobian * Eigen::Vector2d(dx, dy)).cwiseMax(0.0).cwiseMin(limit).array();
    const Eigen::Array2i first = place.cast<int>().min((limit.array() - 1).cast<int>()).max(0);
    const Eigen::Array2d part = place - first.cast<double>();
    const std::uint8_t* row = grey.ptr<std::uint8_t>(first.y()) + first.x();
    const std::uint8_t* below =
        grey.ptr<std::uint8_t>(std::min(first.y() + 1, grey.rows - 1)) + first.x();
    const int right = first.x() + 1 < grey.cols ? 1 : 0;
    const double upper = row[0] + part.x() * (row[right] - row[0]);
    return upper + part.y() * (below[0] + part.x() * (below[right] - below[0]) - upper);
  };
  const double centre = at(0, 0);
  std::uint64_t bits = 0;
  for (int dy = -kRadiusY; dy <= kRadiusY; ++dy) {
    for (int dx = -kRadiusX; dx <= kRadiusX; ++dx) bits = 2 * bits + (at(dx, dy) < centre ? 1 : 0);
  }
  return bits;
}

// Share of the bits in which a window of one set differs from one of the other.
double MeanDifference(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
  constexpr double kNumBits = 62;
  int sum = 0;
  for (const std::uint64_t one : a) {
    for (const std::uint64_t other : b) sum += std::popcount(one ^ other);
  }
  return sum / (kNumBits * static_cast<double>(a.size() * b.size()));
}

// The grey images of a bundle and the projections of the reference into the sources.
class Sides {
 public:
  Sides(const GreyImages& images, const SweepGeometry& geometry)
      : camera_(geometry.camera()),
        projections_(geometry.Projections(0)),
        reference_(images.reference),
        sources_(images.sources) {}

  // Empty unless both sides see the point.
  std::optional<SideDifferences> Differences(int x, int y, double inverse_depth,
                                             const cv::Vec3f& normal) const {
    if (!HasWindow(reference_, x, y)) return std::nullopt;
    const std::uint64_t reference = Census(reference_, x, y);
    const Plane plane = PlaneOf(x, y, inverse_depth, normal);
    const std::vector<std::uint64_t> before = Seen(plane, 0);
    const std::vector<std::uint64_t> after = Seen(plane, sources_.size() / 2);
    if (before.empty() || after.empty()) return std::nullopt;
    SideDifferences differences;
    differences.before = MeanDifference({reference}, before);
    differences.after = MeanDifference({reference}, after);
    differences.across = MeanDifference(before, after);
    differences.worse = std::max(differences.before, differences.after);
    return differences;
  }

 private:
  // The tangent plane at a pixel: its inverse depth and how that changes with the pixel, 1/su and
  // 1/(su px).
  struct Plane {
    Eigen::Vector2d pixel;
    double inverse_depth;
    Eigen::RowVector2d gradient;
  };

  // On a plane n.p = c inverse depth is n.ray / c. Parallel to the image where there is no normal,
  // or it is seen edge-on.
  Plane PlaneOf(int x, int y, double inverse_depth, const cv::Vec3f& normal) const {
    constexpr double kEdgeOn = 0.1;
    const Eigen::Vector3d n(normal[0], normal[1], normal[2]);
    const double along =
        n.dot(Eigen::Vector3d((x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1));
    Plane plane{{x, y}, inverse_depth, Eigen::RowVector2d::Zero()};
    if (along < -kEdgeOn) {
      plane.gradient =
          inverse_depth / along * Eigen::RowVector2d(n.x() / camera_.fx, n.y() / camera_.fy);
    }
    return plane;
  }

  // The windows of the half of the sources that begins with `first`.
  std::vector<std::uint64_t> Seen(const Plane& plane, std::size_t first) const {
    std::vector<std::uint64_t> seen;
    for (std::size_t source = first; source < first + sources_.size() / 2; ++source) {
      const SourceProjection& projection = projections_[source];
      const Eigen::Vector3d at =
          projection.A * plane.pixel.homogeneous() + plane.inverse_depth * projection.b;
      if (!(at.z() > 0)) continue;
      const Eigen::Vector2d pixel = at.hnormalized();
      if (!(pixel.cwiseAbs().maxCoeff() < 1e6)) continue;  // fits an integer
      if (!projection.bounds.Contain(pixel)) continue;
      const int u = static_cast<int>(std::lround(pixel.x()));
      const int v = static_cast<int>(std::lround(pixel.y()));
      if (!HasWindow(sources_[source], u, v)) continue;
      const Eigen::Matrix<double, 3, 2> change =
          projection.A.leftCols<2>() + projection.b * plane.gradient;
      const Eigen::Matrix2d jacobian = (change.topRows<2>() - pixel * change.row(2)) / at.z();
      if (!jacobian.allFinite()) continue;  // next to the source's centre
      seen.push_back(WarpedCensus(sources_[source], pixel, jacobian));
    }
    return seen;
  }

  CameraModel camera_;
  SourceProjections projections_;
  cv::Mat reference_;
  std::vector<cv::Mat> sources_;
};

}  // namespace

std::optional<SideDifferences> MeasureSides(const GreyImages& images, const SweepGeometry& geometry,
                                            const cv::Mat& depth, const cv::Mat& normal) {
  const Sides sides(images, geometry);
  SideDifferences sum;
  int num_samples = 0;
  const int every = std::max(1, cv::countNonZero(depth) / kNumPixels);
  int num_passed = 0;
  for (int y = 0; y < depth.rows; ++y) {
    const float* row = depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      if (!(row[x] > 0) || ++num_passed % every != 0) continue;
      const auto at_pixel = sides.Differences(x, y, 1 / double(row[x]), normal.at<cv::Vec3f>(y, x));
      if (!at_pixel) continue;
      sum.before += at_pixel->before;
      sum.after += at_pixel->after;
      sum.across += at_pixel->across;
      sum.worse += at_pixel->worse;
      ++num_samples;
    }
  }
  if (num_samples < kMinNumPixels) return std::nullopt;
  return SideDifferences{sum.before / num_samples, sum.after / num_samples,
                         sum.across / num_samples, sum.worse / num_samples};
}

bool AreUnrelated(const SideDifferences& sides) {
  if (sides.worse < kMaxSureDifference) return false;
  const double mean = 0.5 * (sides.before + sides.after);
  const double independent = sides.before + sides.after - 2 * sides.before * sides.after;
  return sides.across - mean > kMaxIndependence * (independent - mean);
}

}  // namespace mono3d
