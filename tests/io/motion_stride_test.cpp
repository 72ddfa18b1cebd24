// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/motion_stride.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "io/image_motion.h"

namespace mono3d {
namespace {

using testing::ElementsAre;

constexpr int kViewWidth = 384;
constexpr int kViewHeight = 216;

// A wall with structures of some pixels, larger than an image.
const cv::Mat& Wall() {
  static const cv::Mat wall = [] {
    cv::Mat noise(2 * kViewHeight, 3 * kViewWidth, CV_8UC3);
    cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::Mat smooth;
    cv::GaussianBlur(noise, smooth, {}, 3);
    cv::normalize(smooth, smooth, 20, 230, cv::NORM_MINMAX);
    return smooth;
  }();
  return wall;
}

// What a camera over the wall sees that has moved by (x, y) px and turned about its axis.
cv::Mat View(double x, double y = 0, double turn_deg = 0) {
  cv::Mat to_view =
      cv::getRotationMatrix2D(cv::Point2f(0.5F * kViewWidth, 0.5F * kViewHeight), turn_deg, 1);
  to_view.at<double>(0, 2) -= 20 + x;
  to_view.at<double>(1, 2) -= 20 + y;
  cv::Mat view;
  cv::warpAffine(Wall(), view, to_view, {kViewWidth, kViewHeight}, cv::INTER_LINEAR,
                 cv::BORDER_REFLECT);
  return view;
}

cv::Mat WithNoise(const cv::Mat& image, std::uint64_t seed) {
  cv::Mat noise(image.size(), CV_16SC3);
  cv::RNG(seed).fill(noise, cv::RNG::NORMAL, 0, 5);
  cv::Mat sum;
  cv::add(image, noise, sum, {}, CV_8UC3);
  return sum;
}

std::optional<double> Motion(const cv::Mat& from, const cv::Mat& to) {
  return ImageMotion(SmallImage(from)).To(SmallImage(to));
}

// Of the longer side: a tenth of a pixel of the small image.
constexpr double kTolerance = 0.1 / 192;

TEST(ImageMotion, IsAShareOfTheLongerSide) {
  for (const double moved_px : {0., 0.7, 3., 10.}) {
    EXPECT_NEAR(Motion(View(0), View(moved_px)).value_or(-1), moved_px / kViewWidth, kTolerance);
    EXPECT_NEAR(Motion(View(0), View(0, moved_px)).value_or(-1), moved_px / kViewWidth, kTolerance);
  }
}

TEST(ImageMotion, DoesNotDependOnNoiseOrBrightness) {
  cv::Mat darker;
  View(3).convertTo(darker, -1, 0.8, -5);
  // Noise of 5 of four pixels is 2.5 in the small image, of whose blocks some are flat.
  EXPECT_NEAR(Motion(WithNoise(View(0), 1), WithNoise(darker, 2)).value_or(-1), 3. / kViewWidth,
              2 * kTolerance);
}

TEST(ImageMotion, IsThatOfThreeQuartersOfTheImage) {
  cv::Mat with_car = View(0).clone();
  View(9)(cv::Rect(0, 0, kViewWidth / 5, kViewHeight))
      .copyTo(with_car(cv::Rect(0, 0, kViewWidth / 5, kViewHeight)));
  EXPECT_LT(Motion(View(0), with_car).value_or(1), kTolerance);
}

TEST(ImageMotion, SeesTurnsAboutTheAxis) {
  // An upper quarter of the image lies farther from its middle than 0.4 of its width.
  const double turn_deg = 2;
  const double expected = 0.4 * turn_deg * CV_PI / 180;
  EXPECT_NEAR(Motion(View(0), View(0, 0, turn_deg)).value_or(-1), expected, 0.2 * expected);
}

TEST(ImageMotion, IsNotKnownBetweenUnrelatedImages) {
  EXPECT_FALSE(Motion(View(0), View(kViewWidth, kViewHeight / 2.)));
  EXPECT_FALSE(Motion(View(0), cv::Mat::zeros(kViewHeight, kViewWidth, CV_8UC3)));
  EXPECT_FALSE(Motion(cv::Mat::zeros(kViewHeight, kViewWidth, CV_8UC3), View(0)));
  EXPECT_FALSE(Motion(View(0), View(0).colRange(0, kViewWidth / 2)));
}

// Images in their order.
class Film : public ImageSource {
 public:
  explicit Film(std::vector<cv::Mat> images) : images_(std::move(images)) {}

  std::optional<SourceImage> Next() override {
    if (next_ == images_.size()) return std::nullopt;
    const auto index = static_cast<std::int64_t>(next_);
    return SourceImage{index, 0.1 * static_cast<double>(index), "", images_[next_++]};
  }
  std::optional<std::int64_t> num_frames() const override {
    return static_cast<std::int64_t>(images_.size());
  }
  std::int64_t num_skipped() const override { return 7; }

 private:
  std::vector<cv::Mat> images_;
  std::size_t next_ = 0;
};

struct Taken {
  std::vector<std::int64_t> indices;
  std::int64_t num_passed_over = 0;
};

Taken Take(std::vector<cv::Mat> images, int max_frames = 0) {
  const auto source = StrideByMotion(std::make_unique<Film>(std::move(images)), max_frames);
  Taken taken;
  while (const auto image = source->Next()) taken.indices.push_back(image->index);
  taken.num_passed_over = source->num_passed_over();
  EXPECT_EQ(source->num_skipped(), 7);
  return taken;
}

// A camera that moves sideways by so many px from image to image.
std::vector<cv::Mat> Flight(int num_images, double step_px) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < num_images; ++i) images.push_back(View(i * step_px));
  return images;
}

TEST(MotionStride, TakesEachImageOfAFastFlight) {
  const Taken taken = Take(Flight(6, 3));
  EXPECT_THAT(taken.indices, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(taken.num_passed_over, 0);
}

TEST(MotionStride, TakesAnImageEachTwoHundredthOfTheWidth) {
  // 384 / 200 = 1.92 px.
  const Taken taken = Take(Flight(10, 0.7));
  EXPECT_THAT(taken.indices, ElementsAre(0, 3, 6, 9));
  EXPECT_EQ(taken.num_passed_over, 6);
}

TEST(MotionStride, DoesNotDependOnTheRate) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < 15; ++i) {
    images.push_back(WithNoise(View(3 * (i / 3)), static_cast<std::uint64_t>(i)));
  }
  EXPECT_THAT(Take(images).indices, ElementsAre(0, 3, 6, 9, 12));
}

TEST(MotionStride, LeavesMoreAndMoreOutWhileTheCameraStandsStill) {
  std::vector<cv::Mat> images(100, View(0));
  images.push_back(View(3));
  images.push_back(View(6));
  const Taken taken = Take(images);
  // Steps that grow fourfold; then the camera moves.
  EXPECT_THAT(taken.indices, ElementsAre(0, 4, 20, 84, 100, 101));
  EXPECT_EQ(taken.num_passed_over, 96);
}

TEST(MotionStride, TakesWhatItCannotJudge) {
  std::vector<cv::Mat> images(3, View(0));
  for (int i = 0; i < 3; ++i) images.push_back(cv::Mat::zeros(kViewHeight, kViewWidth, CV_8UC3));
  images.push_back(View(0));
  images.push_back(View(0));
  EXPECT_THAT(Take(images).indices, ElementsAre(0, 3, 4, 5, 6));
}

TEST(MotionStride, CountsTheImagesThatItTakes) {
  EXPECT_THAT(Take(Flight(10, 0.7), 2).indices, ElementsAre(0, 3));
  EXPECT_EQ(StrideByMotion(std::make_unique<Film>(Flight(3, 1)), 0)->num_frames(), 3);
  EXPECT_EQ(StrideByMotion(std::make_unique<Film>(Flight(3, 1)), 2)->num_frames(), 2);
}

TEST(MotionStride, GivesTheSameEachTime) {
  const std::vector<cv::Mat> images = Flight(20, 1.1);
  EXPECT_EQ(Take(images).indices, Take(images).indices);
}

}  // namespace
}  // namespace mono3d
