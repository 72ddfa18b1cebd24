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

constexpr int kSample = 640;  // pixels
// Below this the median is that of a few neighbouring pixels.
constexpr std::size_t kLeastSample = 25;
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

// The grey images of a bundle, and where the sources see the reference.
class Sides {
 public:
  Sides(const ImageBundle& bundle, const SweepGeometry& geometry)
      : projections_(geometry.Projections(0)), reference_(ToGrey(bundle.reference().frame.bgr)) {
    for (const Keyframe& keyframe : bundle.keyframes) {
      if (&keyframe != &bundle.reference()) sources_.push_back(ToGrey(keyframe.frame.bgr));
    }
  }

  // Of sources 0 to half their number, and of the others. Empty unless both sides see the point.
  std::optional<int> WorseCost(int x, int y, double inverse_depth) const {
    if (!HasWindow(reference_, x, y)) return std::nullopt;
    const std::uint64_t census = Census(reference_, x, y);
    int worse = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      int sum = 0, num_visible = 0;
      for (std::size_t i = 0; i < sources_.size() / 2; ++i) {
        const std::size_t source = side * sources_.size() / 2 + i;
        const SourceProjection& projection = projections_[source];
        const Eigen::Vector3d at =
            projection.A * Eigen::Vector3d(x, y, 1) + inverse_depth * projection.b;
        if (!(at.z() > 0)) continue;
        const Eigen::Vector2d pixel = at.hnormalized();
        if (!(pixel.cwiseAbs().maxCoeff() < 1e6)) continue;  // fits an integer
        const int u = static_cast<int>(std::lround(pixel.x()));
        const int v = static_cast<int>(std::lround(pixel.y()));
        if (!HasWindow(sources_[source], u, v)) continue;
        sum += std::popcount(census ^ Census(sources_[source], u, v));
        ++num_visible;
      }
      if (num_visible == 0) return std::nullopt;
      worse = std::max(worse, 2 * sum / num_visible);
    }
    return worse;
  }

 private:
  SourceProjections projections_;
  cv::Mat reference_;
  std::vector<cv::Mat> sources_;
};

}  // namespace

std::optional<int> CostOfWorseSide(const ImageBundle& bundle, const SweepGeometry& geometry,
                                   const cv::Mat& depth) {
  const Sides sides(bundle, geometry);
  std::vector<int> costs;
  const int every = std::max(1, cv::countNonZero(depth) / kSample);
  int num_passed = 0;
  for (int y = 0; y < depth.rows; ++y) {
    const float* row = depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      if (!(row[x] > 0) || ++num_passed % every != 0) continue;
      if (const auto cost = sides.WorseCost(x, y, 1 / double(row[x]))) costs.push_back(*cost);
    }
  }
  if (costs.size() < kLeastSample) return std::nullopt;
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::nth_element(costs.begin(), middle, costs.end());
  return *middle;
}

}  // namespace mono3d
