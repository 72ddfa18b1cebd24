// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace mono3d {
namespace {

constexpr int kLongerSide_px = 192;
// One block each.
constexpr int kCell_px = 16;
// Where there are fewer, who knows what the rest of the image does.
constexpr std::size_t kMinBlocks = 12;
// Blocks must be certain to that, in px: a small part of any motion that matters.
constexpr float kMaxSigma_px = 0.25F;
// Standard deviation of a small image's grey values, at the least: rounding and compression.
constexpr float kMinNoise = 1;

}  // namespace

SmallImage::SmallImage(const cv::Mat& bgr) {
  const double scale =
      std::min(1.0, kLongerSide_px / static_cast<double>(std::max(bgr.cols, bgr.rows)));
  const cv::Size size(std::max(1, static_cast<int>(std::lround(scale * bgr.cols))),
                      std::max(1, static_cast<int>(std::lround(scale * bgr.rows))));
  cv::Mat small;
  cv::resize(bgr, small, size, 0, 0, cv::INTER_AREA);
  cv::cvtColor(small, small, cv::COLOR_BGR2GRAY);
  small.convertTo(levels[0], CV_32F);
  for (std::size_t i = 1; i < kNumLevels; ++i) cv::pyrDown(levels[i - 1], levels[i]);
}

ImageMotion::ImageMotion(SmallImage from) : from_(std::move(from)) {
  const cv::Mat& image = from_.levels[0];
  cv::Mat cornerness;
  cv::cornerMinEigenVal(image, cornerness, kSide_px, 3);
  // Room for the block, its steps and a motion as large as most.
  constexpr int kMargin_px = 2 * kRadius_px;
  for (int y = kMargin_px; y + kCell_px + kMargin_px <= image.rows; y += kCell_px) {
    for (int x = kMargin_px; x + kCell_px + kMargin_px <= image.cols; x += kCell_px) {
      cv::Point best;
      cv::minMaxLoc(cornerness(cv::Rect(x, y, kCell_px, kCell_px)), nullptr, nullptr, nullptr,
                    &best);
      AddBlock(cv::Point(x, y) + best);
    }
  }
}

// Where the coarser levels show nothing there, the finer ones have to do.
void ImageMotion::AddBlock(cv::Point centre) {
  Block block;
  for (std::size_t i = 0; i < SmallImage::kNumLevels; ++i) {
    const float scale = 1 / static_cast<float>(1 << i);
    const cv::Point2f at = scale * cv::Point2f(centre);
    block[i] = MakeTemplate(from_.levels[i], {cvRound(at.x), cvRound(at.y)});
  }
  if (block[0]) blocks_.push_back(block);
}

// Nothing where no image could tell where it is.
std::optional<ImageMotion::Template> ImageMotion::MakeTemplate(const cv::Mat& image, cv::Point at) {
  constexpr int kWithSteps_px = kRadius_px + 1;
  const cv::Rect needed(at.x - kWithSteps_px, at.y - kWithSteps_px, 2 * kWithSteps_px + 1,
                        2 * kWithSteps_px + 1);
  if ((needed & cv::Rect({}, image.size())) != needed) return std::nullopt;
  Template made;
  made.centre = at;
  cv::Point2f mean_step;
  float mean = 0;
  std::size_t i = 0;
  for (int y = at.y - kRadius_px; y <= at.y + kRadius_px; ++y) {
    for (int x = at.x - kRadius_px; x <= at.x + kRadius_px; ++x, ++i) {
      made.grey[i] = image.at<float>(y, x);
      made.steps[i] = {0.5F * (image.at<float>(y, x + 1) - image.at<float>(y, x - 1)),
                       0.5F * (image.at<float>(y + 1, x) - image.at<float>(y - 1, x))};
      mean += made.grey[i] / kArea;
      mean_step += made.steps[i] / static_cast<float>(kArea);
    }
  }
  float xx = 0;
  float xy = 0;
  float yy = 0;
  for (i = 0; i < kArea; ++i) {
    made.grey[i] -= mean;
    made.steps[i] -= mean_step;
    made.variance += made.grey[i] * made.grey[i] / kArea;
    xx += made.steps[i].x * made.steps[i].x;
    xy += made.steps[i].x * made.steps[i].y;
    yy += made.steps[i].y * made.steps[i].y;
  }
  const float min_eigenvalue = 0.5F * (xx + yy - std::sqrt((xx - yy) * (xx - yy) + 4 * xy * xy));
  if (kMinNoise * kMinNoise > kMaxSigma_px * kMaxSigma_px * min_eigenvalue) return std::nullopt;
  const float determinant = xx * yy - xy * xy;
  made.inverse_xx = yy / determinant;
  made.inverse_xy = -xy / determinant;
  made.inverse_yy = xx / determinant;
  return made;
}

// By how much the block has moved on a level, in its px, begun at `motion`. Nothing where it has
// left the image, or what is there looks otherwise.
std::optional<cv::Point2f> ImageMotion::Align(const Template& block, const cv::Mat& grey,
                                              cv::Point2f motion) {
  constexpr int kMaxSteps = 10;
  constexpr float kConverged_px = 0.02F;
  // Of the grey values' variance.
  constexpr float kMaxResidualShare = 0.25F;
  float residual_variance = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const cv::Point2f corner = block.centre + motion - cv::Point2f(kRadius_px, kRadius_px);
    const int x0 = cvFloor(corner.x);
    const int y0 = cvFloor(corner.y);
    if (x0 < 0 || y0 < 0 || x0 + kSide_px >= grey.cols || y0 + kSide_px >= grey.rows) {
      return std::nullopt;
    }
    const float u = corner.x - static_cast<float>(x0);
    const float v = corner.y - static_cast<float>(y0);
    std::array<float, kArea> values;
    float mean = 0;
    std::size_t i = 0;
    for (int y = 0; y < kSide_px; ++y) {
      const float* upper = grey.ptr<float>(y0 + y) + x0;
      const float* lower = grey.ptr<float>(y0 + y + 1) + x0;
      for (int x = 0; x < kSide_px; ++x, ++i) {
        values[i] = (1 - v) * ((1 - u) * upper[x] + u * upper[x + 1]) +
                    v * ((1 - u) * lower[x] + u * lower[x + 1]);
        mean += values[i] / kArea;
      }
    }
    float sum_x = 0;
    float sum_y = 0;
    residual_variance = 0;
    for (i = 0; i < kArea; ++i) {
      const float residual = values[i] - mean - block.grey[i];
      sum_x += residual * block.steps[i].x;
      sum_y += residual * block.steps[i].y;
      residual_variance += residual * residual / kArea;
    }
    const cv::Point2f change(block.inverse_xx * sum_x + block.inverse_xy * sum_y,
                             block.inverse_xy * sum_x + block.inverse_yy * sum_y);
    motion -= change;
    if (std::abs(change.x) + std::abs(change.y) < kConverged_px) break;
  }
  if (residual_variance > kMaxResidualShare * block.variance) return std::nullopt;
  return motion;
}

// By how much it has moved, in px of the finest level.
std::optional<cv::Point2f> ImageMotion::Find(const Block& block, const SmallImage& image) {
  cv::Point2f motion;
  for (std::size_t level = SmallImage::kNumLevels; level-- > 0;) {
    const auto scale = static_cast<float>(1 << level);
    std::optional<cv::Point2f> aligned;
    if (block[level]) aligned = Align(*block[level], image.levels[level], motion / scale);
    if (aligned) motion = scale * *aligned;
    if (level == 0 && !aligned) return std::nullopt;
  }
  return motion;
}

std::optional<double> ImageMotion::To(const SmallImage& image) const {
  if (image.levels[0].size() != from_.levels[0].size() || blocks_.size() < kMinBlocks) {
    return std::nullopt;
  }
  std::vector<float> lengths;
  for (const Block& block : blocks_) {
    if (const auto motion = Find(block, image)) lengths.push_back(std::hypot(motion->x, motion->y));
  }
  // Else what is left to see is not the same.
  if (lengths.size() < 2 * blocks_.size() / 3) return std::nullopt;
  const auto upper = lengths.begin() + static_cast<std::ptrdiff_t>(3 * lengths.size() / 4);
  std::nth_element(lengths.begin(), upper, lengths.end());
  const cv::Size size = from_.levels[0].size();
  return *upper / static_cast<double>(std::max(size.width, size.height));
}

}  // namespace mono3d
