// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/static_parts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr int kLongerSide_px = 640;
constexpr int kWindow_px = 5;  // of the structure tensor
// A corner that moves by more than its size between any two of n images keeps 1 / n of its strength
// in their mean, more where it comes back: of 40 neighbouring images of twelve recordings the
// hundredth that keeps most kept .08 to .42 (of 14 to 20, up to .82), and what was drawn into such
// images .93 and more.
constexpr int kEnoughImages = 25;
constexpr float kStays = 0.8F;
// Of fewer images chance corners may keep that: what keeps more has to take so much of the image,
// twice what it takes by chance (the most of 23 recordings: 5.7 % of 10 images, 3.6 % of 14, 1.0 %
// of 20).
constexpr int kMinImages = 12;
constexpr float kStaysInFew = 0.9F;
constexpr double kShareInMinImages = 0.08;
constexpr double kShareInEnoughImages = 0.02;
// Beside it: what changes now and then, such as digits, and what one sees through.
constexpr float kStaysPartly = 0.4F;
// Where more than half of the corners keep more than that, the camera stood still. So much of the
// images must have corners that move to be a scene all the same, as on a turntable: with a feature
// every ten pixels the tracker finds 150 of them.
constexpr float kMaxMedianOfScene = 0.2F;
constexpr double kMinMovingShare = 0.05;
// Two grey levels per pixel in the weaker direction: weaker corners are not tracked.
constexpr float kMinStrength = 4;
// Correlation of the gradients of two images from which on they show the same.
constexpr double kSameImage = 0.9;
// The reach of compression and of interpolation.
constexpr int kMargin_px = 3;
// Across gaps between letters and spots.
constexpr int kGap_px = 9;
// Grey levels between which a bar stays: compression.
constexpr int kMaxChangeOfBar = 8;
// Twice that of bars, which have no light that changes.
constexpr float kMaxChangeOfBare = 16;
// Smaller ones are chance: a letter of text that can be read has more.
constexpr int kMinArea_px = 30;

constexpr int kTensorRadius_px = kWindow_px / 2;
constexpr int kTensorLanes = cv::v_float32x4::nlanes;  // pixels that are worked on together

int InWholeSteps(int width) { return (width + kTensorLanes - 1) / kTensorLanes * kTensorLanes; }

// Of the structure tensor, in a row: sums over the window's rows, and beyond both ends over what
// lies there mirrored.
class TensorRow {
 public:
  explicit TensorRow(int width)
      : width_(width), xx_(Padded(width)), xy_(Padded(width)), yy_(Padded(width)) {}

  void Clear() {
    for (std::vector<float>* values : {&xx_, &xy_, &yy_}) std::ranges::fill(*values, 0.0F);
  }

  void Add(const float* x, const float* y) {
    for (int i = 0; i < width_; i += kTensorLanes) {
      const cv::v_float32x4 x4 = cv::v_load(x + i);
      const cv::v_float32x4 y4 = cv::v_load(y + i);
      Add(x4 * x4, At(xx_, i));
      Add(x4 * y4, At(xy_, i));
      Add(y4 * y4, At(yy_, i));
    }
  }

  // The least eigenvalue of the mean tensor at each pixel.
  void Strength(float* strength) {
    for (std::vector<float>* values : {&xx_, &xy_, &yy_}) Mirror(*values);
    constexpr float kPerPixel = 1.0F / (kWindow_px * kWindow_px);
    const cv::v_float32x4 half = cv::v_setall_f32(0.5F * kPerPixel);
    const cv::v_float32x4 whole = cv::v_setall_f32(kPerPixel);
    for (int i = 0; i < width_; i += kTensorLanes) {
      const cv::v_float32x4 xx = half * Sum(xx_, i);
      const cv::v_float32x4 yy = half * Sum(yy_, i);
      const cv::v_float32x4 xy = whole * Sum(xy_, i);
      const cv::v_float32x4 half_difference = xx - yy;
      cv::v_store(strength + i, xx + yy - cv::v_sqrt(half_difference * half_difference + xy * xy));
    }
  }

 private:
  static std::size_t Padded(int width) {
    return static_cast<std::size_t>(kTensorRadius_px + InWholeSteps(width) + kTensorRadius_px);
  }
  static float* At(std::vector<float>& values, int i) {
    return values.data() + kTensorRadius_px + i;
  }
  static void Add(const cv::v_float32x4& values, float* to) {
    cv::v_store(to, cv::v_load(to) + values);
  }
  static cv::v_float32x4 Sum(std::vector<float>& values, int i) {
    cv::v_float32x4 sum = cv::v_setzero_f32();
    for (int k = -kTensorRadius_px; k <= kTensorRadius_px; ++k)
      sum += cv::v_load(At(values, i) + k);
    return sum;
  }
  void Mirror(std::vector<float>& values) const {
    float* const first = At(values, 0);
    for (int k = 1; k <= kTensorRadius_px; ++k) {
      first[-k] = first[cv::borderInterpolate(-k, width_, cv::BORDER_REFLECT_101)];
      first[width_ - 1 + k] =
          first[cv::borderInterpolate(width_ - 1 + k, width_, cv::BORDER_REFLECT_101)];
    }
  }

  int width_;
  std::vector<float> xx_, xy_, yy_;
};

// In one pass, as such images are looked at before anything else is done.
cv::Mat CornerStrength(const cv::Mat& x, const cv::Mat& y) {
  const int padding = InWholeSteps(x.cols) - x.cols;
  cv::Mat padded_x;
  cv::Mat padded_y;
  cv::copyMakeBorder(x, padded_x, 0, 0, 0, padding, cv::BORDER_CONSTANT);
  cv::copyMakeBorder(y, padded_y, 0, 0, 0, padding, cv::BORDER_CONSTANT);
  cv::Mat strength(padded_x.size(), CV_32FC1);
  TensorRow tensor(x.cols);
  for (int v = 0; v < x.rows; ++v) {
    tensor.Clear();
    for (int k = -kTensorRadius_px; k <= kTensorRadius_px; ++k) {
      const int row = cv::borderInterpolate(v + k, x.rows, cv::BORDER_REFLECT_101);
      tensor.Add(padded_x.ptr<float>(row), padded_y.ptr<float>(row));
    }
    tensor.Strength(strength.ptr<float>(v));
  }
  return strength.colRange(0, x.cols);
}

cv::Mat Dilated(const cv::Mat& mask, int radius_px) {
  const int side = 2 * radius_px + 1;
  cv::Mat dilated;
  cv::dilate(mask, dilated, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return dilated;
}

// Of the image, what keeps more than kStaysInFew in so many images, fewer than kEnoughImages.
double LeastShareOfFew(int num_images) {
  const double share =
      static_cast<double>(kEnoughImages - num_images) / (kEnoughImages - kMinImages);
  return kShareInEnoughImages + share * (kShareInMinImages - kShareInEnoughImages);
}

// The parts of `mask` that hold enough of `seeds`.
cv::Mat PartsAround(const cv::Mat& seeds, const cv::Mat& mask) {
  cv::Mat labels;
  const int num_labels = cv::connectedComponents(mask, labels, 8, CV_32S);
  std::vector<int> num_seeds(static_cast<std::size_t>(num_labels), 0);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (seeds.at<uchar>(y, x) != 0) ++num_seeds[static_cast<std::size_t>(labels.at<int>(y, x))];
    }
  }
  cv::Mat parts(mask.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const int label = labels.at<int>(y, x);
      if (label == 0 || num_seeds[static_cast<std::size_t>(label)] < kMinArea_px) continue;
      parts.at<uchar>(y, x) = 255;
    }
  }
  return parts;
}

// The lines from one border on in which nothing ever changes, in a mask of `constant`.
int NumBarRows(const cv::Mat& constant) {
  int num_rows = 0;
  while (num_rows < constant.rows && cv::countNonZero(constant.row(num_rows) == 0) == 0) ++num_rows;
  return num_rows;
}

void AddBars(const cv::Mat& constant, cv::Mat& parts) {
  for (int i = 0; i < 4; ++i) {  // each border in its turn at the top
    cv::Mat view = constant;
    cv::Mat bars = parts;
    if (i % 2 == 1) {
      view = constant.t();
      bars = parts.t();
    }
    if (i >= 2) {
      cv::flip(view, view, 0);
      cv::flip(bars, bars, 0);
    }
    bars.rowRange(0, NumBarRows(view)).setTo(255);
    if (i >= 2) cv::flip(bars, bars, 0);
    parts = i % 2 == 1 ? cv::Mat(bars.t()) : bars;
  }
}

double ShareOf(const cv::Mat& mask) {
  return static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
}

// 1 where none is chosen.
float MedianOf(const cv::Mat& values, const cv::Mat& mask) {
  cv::Mat_<float> all;
  values.convertTo(all, CV_32F);
  std::vector<float> chosen;
  for (int y = 0; y < all.rows; ++y) {
    for (int x = 0; x < all.cols; ++x) {
      if (mask.at<uchar>(y, x) != 0) chosen.push_back(all(y, x));
    }
  }
  if (chosen.empty()) return 1;
  const auto middle = chosen.begin() + static_cast<std::ptrdiff_t>(chosen.size() / 2);
  std::nth_element(chosen.begin(), middle, chosen.end());
  return *middle;
}

}  // namespace

void StaticPartsDetector::Add(const cv::Mat& bgr) {
  if (bgr.empty() || bgr.type() != CV_8UC3) throw Error("static parts: images are CV_8UC3");
  if (size_.empty()) size_ = bgr.size();
  if (bgr.size() != size_) throw Error("static parts: images of several sizes");
  const double scale =
      std::min(1.0, static_cast<double>(kLongerSide_px) / std::max(bgr.cols, bgr.rows));
  const cv::Size working(std::max(1, static_cast<int>(std::lround(scale * bgr.cols))),
                         std::max(1, static_cast<int>(std::lround(scale * bgr.rows))));
  cv::Mat grey;
  cv::resize(bgr, grey, working, 0, 0, cv::INTER_AREA);
  cv::cvtColor(grey, grey, cv::COLOR_BGR2GRAY);
  constexpr double kPerPixel = 1.0 / 8;  // of Sobel's sums
  cv::Mat x;
  cv::Mat y;
  cv::Sobel(grey, x, CV_32F, 1, 0, 3, kPerPixel);
  cv::Sobel(grey, y, CV_32F, 0, 1, 3, kPerPixel);
  if (!last_x_.empty()) {
    const double common = x.dot(last_x_) + y.dot(last_y_);
    const double norms = (x.dot(x) + y.dot(y)) * (last_x_.dot(last_x_) + last_y_.dot(last_y_));
    if (common >= kSameImage * std::sqrt(norms)) return;
  }
  const cv::Mat strength = CornerStrength(x, y);
  if (num_images_ == 0) {
    sum_x_ = x.clone();
    sum_y_ = y.clone();
    sum_strength_ = strength;
    least_ = grey.clone();
    most_ = grey;
  } else {
    least_ = cv::min(least_, grey);
    most_ = cv::max(most_, grey);
    sum_x_ += x;
    sum_y_ += y;
    sum_strength_ += strength;
  }
  last_x_ = x;
  last_y_ = y;
  ++num_images_;
}

cv::Mat StaticPartsDetector::Find() const {
  if (num_images_ < kMinImages) return {};
  const cv::Mat of_mean = CornerStrength(sum_x_ / num_images_, sum_y_ / num_images_);
  const cv::Mat mean = sum_strength_ / num_images_;
  cv::Mat kept;
  cv::divide(of_mean, cv::max(mean, 1e-3), kept);
  const cv::Mat is_corner = mean > kMinStrength;
  const double moving_share = ShareOf(is_corner & (kept < kMaxMedianOfScene));
  if (MedianOf(kept, is_corner) > kMaxMedianOfScene && moving_share < kMinMovingShare) return {};
  cv::Mat is_strong = of_mean > kMinStrength;
  // There, edges that end look like corners.
  constexpr int kBorder_px = kWindow_px / 2 + 1;
  cv::rectangle(is_strong, {{}, is_strong.size()}, cv::Scalar(0), 2 * kBorder_px - 1);
  const bool are_few = num_images_ < kEnoughImages;
  if (are_few && ShareOf((kept > kStaysInFew) & is_strong) < LeastShareOfFew(num_images_)) {
    return {};
  }
  const cv::Mat stays = (kept > (are_few ? kStaysInFew : kStays)) & is_strong;
  cv::Mat parts = PartsAround(stays, Dilated((kept > kStaysPartly) & is_strong, kGap_px / 2));
  // Bare parts beside them, as a wall behind a turntable, change less than their corners do, with
  // the noise, the light and the compression of these images.
  const cv::Mat change = most_ - least_;
  const float of_corners = MedianOf(change, stays & (parts != 0));
  parts |= PartsAround(stays & (parts != 0),
                       (parts != 0) | (change <= std::min(of_corners, kMaxChangeOfBare)));
  AddBars((change <= kMaxChangeOfBar) | (parts != 0), parts);
  if (cv::countNonZero(parts) == 0) return {};
  cv::Mat at_size;
  cv::resize(Dilated(parts, kMargin_px), at_size, size_, 0, 0, cv::INTER_NEAREST);
  return at_size;
}

}  // namespace mono3d
