// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/coarse_matches.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "depth/image_cells.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// The census window, 9x7.
constexpr int kWindowReachX = 4;
constexpr int kWindowReachY = 3;
constexpr int kMedianReach = 2;
// Planes of the level: surfaces steeper than one plane a pixel are hidden from one side or the
// other, and in the window of the median the farthest pixel is 2 px from the middle.
constexpr double kTolerance = 2;
// Of the window: a tenth are six of its 63 pixels of the level. Beside a straight edge the surface
// on one side at least is matched, which is half of the window.
constexpr double kMinShareMatched = 0.1;
constexpr double kMaxShareMatched = 0.5;
constexpr double kErrorUnit = 1e-3;  // of the depth, as surface.comp has it

int SumIn(const cv::Mat& integral, const cv::Rect& window) {
  const cv::Point end = window.br();
  return integral.at<int>(end) - integral.at<int>(window.y, end.x) -
         integral.at<int>(end.y, window.x) + integral.at<int>(window.tl());
}

// At full resolution, with what the windows of all levels share.
class MatchedPixels {
 public:
  explicit MatchedPixels(const CoarseMatchesInput& input)
      : depth_(input.depth), response_(input.response) {
    cv::integral((depth_ > 0) / 255, matched_, CV_32S);
  }

  // 0: not matched.
  double InverseDepthAt(const cv::Point& pixel) const {
    const float depth = depth_.at<float>(pixel);
    return depth > 0 ? 1 / double(depth) : 0;
  }
  double ResponseAt(const cv::Point& pixel) const { return response_.at<std::int32_t>(pixel); }
  cv::Size size() const { return depth_.size(); }
  double ShareIn(const cv::Rect& window) const {
    return double(SumIn(matched_, window)) / window.area();
  }
  bool AreAllIn(const cv::Rect& window) const { return SumIn(matched_, window) == window.area(); }

 private:
  cv::Mat depth_;
  cv::Mat response_;
  cv::Mat matched_;  // integral image
};

class CoarseLevelMatches {
 public:
  CoarseLevelMatches(const CoarseMatches& matches, const CoarseMatchesInput& input,
                     const MatchedPixels& pixels)
      : matches_(matches),
        input_(input),
        pixels_(pixels),
        confidences_(matches.inverse_depth.size(), CV_32FC1, cv::Scalar(-1)) {}

  // What FindCoarseMatches says of a pixel; none where it does not count.
  std::optional<cv::Vec3f> At(const cv::Point& pixel) {
    const cv::Point coarse(pixel.x >> matches_.level, pixel.y >> matches_.level);
    float& confidence = confidences_.at<float>(coarse);
    if (confidence < 0) confidence = ConfidenceAt(coarse);
    if (confidence == 0) return std::nullopt;
    return cv::Vec3f(matches_.inverse_depth.at<float>(coarse), float(matches_.step), confidence);
  }

 private:
  // What a coarse pixel and `reach` more on each side cover.
  cv::Rect WindowAround(const cv::Point& coarse, const cv::Point& reach) const {
    const int side = 1 << matches_.level;
    const cv::Point from = (coarse - reach) * side;
    const cv::Point to = (coarse + reach + cv::Point(1, 1)) * side;
    return cv::Rect(from, to) & cv::Rect(cv::Point(), pixels_.size());
  }

  float ConfidenceAt(const cv::Point& coarse) const {
    const cv::Rect window = WindowAround(coarse, {kWindowReachX, kWindowReachY});
    const double share = pixels_.ShareIn(window);
    if (share < kMinShareMatched || share > kMaxShareMatched || !IsSupported(coarse)) return 0;
    Samples samples = SamplesAround(coarse);
    if (samples.mean_response < input_.min_response || samples.differences.empty()) return 0;
    const double median = UpperMedian(std::move(samples.differences));
    if (median > kTolerance * matches_.step) return 0;
    const double error = median / double(matches_.inverse_depth.at<float>(coarse));
    return static_cast<float>(1 / (1 + error / kErrorUnit));
  }

  bool IsWithinTolerance(double w, double middle) const {
    return w > 0 && std::abs(w - middle) <= kTolerance * matches_.step;
  }

  bool IsSupported(const cv::Point& coarse) const {
    const double middle = matches_.inverse_depth.at<float>(coarse);
    if (!(middle > 0)) return false;
    int support = 0;
    for (int dy = -kMedianReach; dy <= kMedianReach; ++dy) {
      for (int dx = -kMedianReach; dx <= kMedianReach; ++dx) {
        // Outside the image its border is repeated.
        const int x = std::clamp(coarse.x + dx, 0, matches_.winners.cols - 1);
        const int y = std::clamp(coarse.y + dy, 0, matches_.winners.rows - 1);
        const bool is_clear = matches_.uniqueness.at<float>(y, x) >= input_.min_uniqueness;
        support += is_clear && IsWithinTolerance(matches_.winners.at<float>(y, x), middle) ? 1 : 0;
      }
    }
    return support >= input_.min_support;
  }

  // The pixels in the middle of the coarse ones of a window.
  struct Samples {
    double mean_response = 0;
    std::vector<double> differences = {};  // in inverse depth, of those that were matched
  };

  Samples SamplesAround(const cv::Point& coarse) const {
    const double middle = matches_.inverse_depth.at<float>(coarse);
    const int side = 1 << matches_.level;
    const cv::Rect image(cv::Point(), pixels_.size());
    Samples samples;
    int num_samples = 0;
    for (int dy = -kWindowReachY; dy <= kWindowReachY; ++dy) {
      for (int dx = -kWindowReachX; dx <= kWindowReachX; ++dx) {
        const cv::Point pixel = (coarse + cv::Point(dx, dy)) * side + cv::Point(side, side) / 2;
        if (!image.contains(pixel)) continue;
        ++num_samples;
        samples.mean_response += pixels_.ResponseAt(pixel);
        const double w = pixels_.InverseDepthAt(pixel);
        if (w > 0) samples.differences.push_back(std::abs(w - middle));
      }
    }
    samples.mean_response /= std::max(num_samples, 1);
    return samples;
  }

  const CoarseMatches& matches_;
  const CoarseMatchesInput& input_;
  const MatchedPixels& pixels_;
  cv::Mat confidences_;  // below 0: not known yet; 0: does not count
};

}  // namespace

cv::Mat FindCoarseMatches(const CoarseMatchesInput& input) {
  const cv::Size size = input.depth.size();
  const cv::Rect image(cv::Point(), size);
  cv::Mat found((size.height + kImageCell_px - 1) / kImageCell_px,
                (size.width + kImageCell_px - 1) / kImageCell_px, CV_32FC3, cv::Scalar(0, 0, 0));
  const MatchedPixels pixels(input);
  std::vector<CoarseLevelMatches> levels;
  for (const CoarseMatches& matches : input.levels) levels.emplace_back(matches, input, pixels);
  for (int y = 0; y < found.rows; ++y) {
    for (int x = 0; x < found.cols; ++x) {
      const cv::Rect cell =
          cv::Rect(x * kImageCell_px, y * kImageCell_px, kImageCell_px, kImageCell_px) & image;
      if (pixels.AreAllIn(cell)) continue;
      const cv::Point middle = cell.tl() + cv::Point(cell.width, cell.height) / 2;
      for (CoarseLevelMatches& level : levels) {
        const std::optional<cv::Vec3f> matched = level.At(middle);
        if (!matched) continue;
        found.at<cv::Vec3f>(y, x) = *matched;
        break;
      }
    }
  }
  return found;
}

}  // namespace mono3d
