// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/hidden_parts.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// Around a part, its colours are taken from there.
constexpr int kAround_px = 8;

cv::Mat ThreeOf(const cv::Mat& channel) {
  cv::Mat three;
  cv::merge(std::vector<cv::Mat>(3, channel), three);
  return three;
}

// Means over ever larger squares of what is shown, downwards, and where nothing is shown those of
// the next larger ones, upwards (Gortler et al. 1996, "pull-push"). `colours`: CV_32FC3, 0 where
// `shown` is.
cv::Mat Filled(const cv::Mat& colours, const cv::Mat& shown) {
  cv::Mat mean;
  cv::divide(colours, ThreeOf(cv::max(shown, 1e-6)), mean);
  const cv::Size half((colours.cols + 1) / 2, (colours.rows + 1) / 2);
  if (half == colours.size()) return mean;
  cv::Mat half_colours;
  cv::Mat half_shown;
  cv::resize(colours, half_colours, half, 0, 0, cv::INTER_AREA);
  cv::resize(shown, half_shown, half, 0, 0, cv::INTER_AREA);
  cv::Mat coarse;
  cv::resize(Filled(half_colours, half_shown), coarse, colours.size(), 0, 0, cv::INTER_LINEAR);
  const cv::Mat weight = ThreeOf(shown);
  return mean.mul(weight) + coarse.mul(cv::Scalar::all(1) - weight);
}

}  // namespace

HiddenParts::HiddenParts(const cv::Mat& hidden) : size_(hidden.size()) {
  if (hidden.type() != CV_8UC1) throw Error("hidden parts: a mask is CV_8UC1");
  cv::Mat labels;
  cv::Mat boxes;
  cv::Mat centres;
  const int num_labels = cv::connectedComponentsWithStats(hidden, labels, boxes, centres);
  for (int i = 1; i < num_labels; ++i) {
    const cv::Rect box(boxes.at<int>(i, cv::CC_STAT_LEFT), boxes.at<int>(i, cv::CC_STAT_TOP),
                       boxes.at<int>(i, cv::CC_STAT_WIDTH), boxes.at<int>(i, cv::CC_STAT_HEIGHT));
    const cv::Rect wide(box.x - kAround_px, box.y - kAround_px, box.width + 2 * kAround_px,
                        box.height + 2 * kAround_px);
    Part part;
    part.area = wide & cv::Rect({}, size_);
    // Other parts within the box too: their colours are none.
    part.hidden = hidden(part.area) != 0;
    cv::Mat(part.hidden == 0).convertTo(part.shown, CV_32F, 1.0 / 255);
    parts_.push_back(std::move(part));
  }
}

cv::Mat HiddenParts::Fill(const cv::Mat& bgr) const {
  if (IsEmpty()) return bgr;
  if (bgr.size() != size_ || bgr.type() != CV_8UC3) {
    throw Error("hidden parts: the image has another size than the mask");
  }
  cv::Mat filled = bgr.clone();
  for (const Part& part : parts_) {
    cv::Mat colours;
    bgr(part.area).convertTo(colours, CV_32F);
    cv::Mat smooth;
    Filled(colours.mul(ThreeOf(part.shown)), part.shown).convertTo(smooth, CV_8U);
    smooth.copyTo(filled(part.area), part.hidden);
  }
  return filled;
}

}  // namespace mono3d
