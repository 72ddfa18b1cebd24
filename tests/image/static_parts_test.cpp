// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/static_parts.h"

#include <gtest/gtest.h>

#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "image/hidden_parts.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr int kViewWidth = 320;
constexpr int kViewHeight = 240;
constexpr int kNumImages = 40;

// Blurred noise larger than an image: a window that moves over it is the view of a camera.
cv::Mat LargeTexture() {
  cv::RNG random(7);
  cv::Mat texture(3 * kViewHeight, 3 * kViewWidth, CV_8UC3);
  random.fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {}, 2);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  return texture;
}

// The i-th image of a camera that moves; `draw` puts something into each.
cv::Mat ViewOf(const cv::Mat& texture, int i, const std::function<void(int, cv::Mat&)>& draw) {
  cv::Mat view = texture({20 + 13 * i, 30 + 7 * i, kViewWidth, kViewHeight}).clone();
  draw(i, view);
  return view;
}

cv::Mat FindIn(const std::function<void(int, cv::Mat&)>& draw, int num_images = kNumImages) {
  const cv::Mat texture = LargeTexture();
  StaticPartsDetector detector;
  for (int i = 0; i < num_images; ++i) detector.Add(ViewOf(texture, i, draw));
  return detector.Find();
}

void DrawText(const std::string& text, cv::Point at, cv::Mat& image) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.8, cv::Scalar::all(255), 2);
}

double ShareIn(const cv::Mat& mask, const cv::Mat& of) {
  return cv::countNonZero(mask & of) / static_cast<double>(cv::countNonZero(of));
}

TEST(StaticParts, AreTextDrawnIntoAVideo) {
  const cv::Mat found = FindIn([](int, cv::Mat& image) { DrawText("ALT 62", {20, 40}, image); });
  ASSERT_EQ(found.size(), cv::Size(kViewWidth, kViewHeight));
  cv::Mat letters(found.size(), CV_8UC1, cv::Scalar(0));
  DrawText("ALT 62", {20, 40}, letters);
  EXPECT_GT(ShareIn(found, letters), 0.95);
  cv::Mat around;
  cv::dilate(letters, around, cv::Mat::ones(21, 21, CV_8UC1));
  EXPECT_EQ(cv::countNonZero(found & (around == 0)), 0);
}

TEST(StaticParts, AreDigitsThatChangeBesideThoseThatDoNot) {
  const cv::Mat found = FindIn([](int i, cv::Mat& image) {
    DrawText("8888" + std::to_string(i / 4 % 10), {20, 40}, image);
  });
  ASSERT_FALSE(found.empty());
  cv::Mat last(found.size(), CV_8UC1, cv::Scalar(0));
  DrawText("8", {20 + cv::getTextSize("8888", cv::FONT_HERSHEY_SIMPLEX, 0.8, 2, nullptr).width, 40},
           last);
  EXPECT_GT(ShareIn(found, last), 0.7);
}

TEST(StaticParts, AreABonnetAtTheLowerEdge) {
  cv::RNG random(3);
  cv::Mat bonnet(60, kViewWidth, CV_8UC3);
  random.fill(bonnet, cv::RNG::UNIFORM, 30, 90);
  cv::GaussianBlur(bonnet, bonnet, {}, 1);
  const cv::Rect below(0, kViewHeight - 60, kViewWidth, 60);
  const cv::Mat found = FindIn([&](int, cv::Mat& image) { bonnet.copyTo(image(below)); });
  ASSERT_FALSE(found.empty());
  EXPECT_GT(cv::countNonZero(found(below)), 0.95 * below.area());
  EXPECT_EQ(cv::countNonZero(found.rowRange(0, kViewHeight - 75)), 0);
}

TEST(StaticParts, AreBarsAlongTheBorders) {
  const cv::Rect content(24, 30, kViewWidth - 24, kViewHeight - 50);
  const cv::Mat found = FindIn([&](int i, cv::Mat& image) {
    cv::Mat bars(image.size(), CV_8UC3, cv::Scalar::all(16 + i % 3));
    image(content).copyTo(bars(content));
    image = bars;
  });
  ASSERT_FALSE(found.empty());
  cv::Mat bars(found.size(), CV_8UC1, cv::Scalar(255));
  bars(content).setTo(0);
  EXPECT_EQ(cv::countNonZero(bars & (found == 0)), 0);
  const cv::Rect inner(content.x + 8, content.y + 8, content.width - 16, content.height - 16);
  EXPECT_EQ(cv::countNonZero(found(inner)), 0);
}

TEST(StaticParts, AreNotAKerbThatTheCameraMovesAlong) {
  // Its texture passes by, its edge stays.
  const cv::Mat found = FindIn([](int, cv::Mat& image) {
    cv::line(image, {0, kViewHeight}, {kViewWidth / 2, 0}, cv::Scalar::all(255), 5, cv::LINE_AA);
  });
  EXPECT_LT(found.empty() ? 0 : cv::countNonZero(found), kViewWidth * kViewHeight / 200);
}

TEST(StaticParts, AreNoneOfAnOrdinaryVideo) {
  EXPECT_TRUE(FindIn([](int, cv::Mat&) {}).empty());
}

TEST(StaticParts, AreNotToldOfACameraThatStandsStill) {
  const cv::Mat texture = LargeTexture();
  cv::RNG random(5);
  StaticPartsDetector detector;
  for (int i = 0; i < kNumImages; ++i) {
    // So much noise that no two images are the same.
    cv::Mat noise(kViewHeight, kViewWidth, CV_16SC3);
    random.fill(noise, cv::RNG::NORMAL, 0, 30);
    cv::Mat image;
    texture({0, 0, kViewWidth, kViewHeight}).convertTo(image, CV_16SC3);
    image += noise;
    image.convertTo(image, CV_8UC3);
    detector.Add(image);
  }
  EXPECT_TRUE(detector.Find().empty());
}

// What turns on a turntable before a camera on a tripod, and what is behind it: a texture above, a
// bare wall below.
class Turntable {
 public:
  static constexpr int kRadius_px = 80;
  static inline const cv::Point kMiddle{kViewWidth / 2, 130};

  cv::Mat Find(double degrees, int num_images) const {
    StaticPartsDetector detector;
    for (int i = 0; i < num_images; ++i) detector.Add(ImageAt(i * degrees));
    return detector.Find();
  }
  static cv::Mat Object() {
    cv::Mat object(kViewHeight, kViewWidth, CV_8UC1, cv::Scalar(0));
    cv::circle(object, kMiddle, kRadius_px, cv::Scalar(255), cv::FILLED);
    return object;
  }

 private:
  cv::Mat ImageAt(double degrees) const {
    const cv::Point2f middle_of_texture(1.5F * kViewWidth, 1.5F * kViewHeight);
    cv::Mat turn = cv::getRotationMatrix2D(middle_of_texture, degrees, 1);
    turn.at<double>(0, 2) += kMiddle.x - 1.5 * kViewWidth;
    turn.at<double>(1, 2) += kMiddle.y - 1.5 * kViewHeight;
    cv::Mat turned;
    cv::warpAffine(texture_, turned, turn, {kViewWidth, kViewHeight});
    cv::Mat image = texture_({0, 0, kViewWidth, kViewHeight}).clone();
    image.rowRange(kViewHeight / 2, kViewHeight).setTo(cv::Scalar(140, 150, 160));
    turned.copyTo(image, Object());
    return image;
  }

  cv::Mat texture_ = LargeTexture();
};

TEST(StaticParts, AreAllThatIsBehindATurntable) {
  for (const int num_images : {40, 12}) {
    const cv::Mat found = Turntable().Find(9, num_images);
    ASSERT_FALSE(found.empty()) << num_images;
    EXPECT_GT(ShareIn(found, Turntable::Object() == 0), 0.95) << num_images;
    EXPECT_LT(ShareIn(found, Turntable::Object()), 0.2) << num_images;  // along its border
  }
  EXPECT_TRUE(Turntable().Find(9, 11).empty());
}

TEST(StaticParts, NeedImagesThatDiffer) {
  const auto draw = [](int, cv::Mat& image) { DrawText("ALT 62", {20, 40}, image); };
  EXPECT_TRUE(FindIn(draw, 24).empty());
  EXPECT_FALSE(FindIn(draw, 25).empty());
  const cv::Mat texture = LargeTexture();
  StaticPartsDetector of_copies;
  for (int i = 0; i < 2 * kNumImages; ++i) of_copies.Add(ViewOf(texture, i / 10, draw));
  EXPECT_TRUE(of_copies.Find().empty());
}

TEST(StaticParts, AreOfImagesOfOneSizeInColour) {
  StaticPartsDetector detector;
  detector.Add(cv::Mat(30, 40, CV_8UC3, cv::Scalar(0)));
  EXPECT_THROW(detector.Add(cv::Mat(40, 30, CV_8UC3, cv::Scalar(0))), Error);
  EXPECT_THROW(detector.Add(cv::Mat(30, 40, CV_8UC1, cv::Scalar(0))), Error);
  EXPECT_THROW(detector.Add(cv::Mat()), Error);
}

cv::Vec3b Plane(int x, int y) {
  return {cv::saturate_cast<uchar>(50 + x), cv::saturate_cast<uchar>(200 - y), 90};
}

TEST(HiddenParts, AreFilledWithWhatIsAroundThem) {
  cv::Mat image(90, 120, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) image.at<cv::Vec3b>(y, x) = Plane(x, y);
  }
  cv::Mat hidden(image.size(), CV_8UC1, cv::Scalar(0));
  hidden({50, 40, 20, 6}).setTo(1);
  hidden({0, 70, 120, 20}).setTo(255);  // to the border
  cv::Mat marred = image.clone();
  marred.setTo(cv::Scalar(0, 0, 255), hidden != 0);
  const cv::Mat filled = HiddenParts(hidden).Fill(marred);
  EXPECT_EQ(cv::norm(filled, image, cv::NORM_INF, hidden == 0), 0);
  EXPECT_LE(cv::norm(filled({50, 40, 20, 6}), image({50, 40, 20, 6}), cv::NORM_INF), 8);
  // What lies beyond the border is not known; nothing of the mark is left.
  EXPECT_LE(cv::norm(filled, image, cv::NORM_INF), 45);
  EXPECT_EQ(marred.at<cv::Vec3b>(80, 60), cv::Vec3b(0, 0, 255)) << "the image itself is left";
}

TEST(HiddenParts, MayBeAllOfAnImageOrNone) {
  const cv::Mat image(20, 30, CV_8UC3, cv::Scalar(10, 20, 30));
  EXPECT_TRUE(HiddenParts().IsEmpty());
  EXPECT_EQ(HiddenParts().Fill(image).data, image.data);
  EXPECT_TRUE(HiddenParts(cv::Mat::zeros(20, 30, CV_8UC1)).IsEmpty());
  const cv::Mat filled = HiddenParts(cv::Mat::ones(20, 30, CV_8UC1)).Fill(image);
  EXPECT_EQ(filled.size(), image.size());
  EXPECT_THROW(HiddenParts(cv::Mat::ones(30, 20, CV_8UC1)).Fill(image), Error);
  EXPECT_THROW(HiddenParts(cv::Mat::ones(30, 20, CV_32FC1)), Error);
}

}  // namespace
}  // namespace mono3d
