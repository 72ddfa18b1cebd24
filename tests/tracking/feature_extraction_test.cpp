// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/feature_extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "tracking/features/feature_grid.h"
#include "tracking/features/pyramid_scales.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kWidth = 768;
constexpr int kImageHeight = 448;

std::vector<Feature> Extract(const cv::Mat& picture, int count = 1000) {
  return ExtractFeatures(picture, FeatureOptions{}, count);
}

TEST(ExtractFeatures, LeavesNoCellOfATexturedPictureEmpty) {
  // The right half has a tenth of the contrast: only the lower threshold finds corners there.
  cv::Mat picture = TexturedPicture(kWidth, kImageHeight, SeedFromTestName());
  cv::Mat right = picture(cv::Rect(kWidth / 2, 0, kWidth / 2, kImageHeight));
  right.convertTo(right, CV_8UC1, 0.25, 96);
  const std::vector<Feature> features = Extract(picture);
  constexpr int kCell = 64;
  std::set<std::pair<int, int>> cells;
  for (const Feature& feature : features) {
    cells.emplace(static_cast<int>(feature.pixel.x()) / kCell,
                  static_cast<int>(feature.pixel.y()) / kCell);
  }
  EXPECT_EQ(cells.size(), static_cast<std::size_t>(kWidth / kCell * kImageHeight / kCell));
}

TEST(ExtractFeatures, FindsAboutAsManyAsAskedFor) {
  const cv::Mat picture = TexturedPicture(kWidth, kImageHeight, SeedFromTestName());
  for (const int wanted : {500, 1000, 2000}) {
    const auto found = static_cast<double>(Extract(picture, wanted).size());
    EXPECT_GE(found, 0.9 * wanted);
    EXPECT_LE(found, 1.1 * wanted);
  }
}

TEST(ExtractFeatures, KeepsCloseToNothingTwice) {
  // On one level no two features lie within 2 px of each other.
  for (const Feature& a : Extract(TexturedPicture(kWidth, kImageHeight, SeedFromTestName()))) {
    ASSERT_GE(a.angle_deg, 0);
    ASSERT_LE(a.angle_deg, 360);
    ASSERT_TRUE(a.pixel.x() >= 0 && a.pixel.x() < kWidth);
    ASSERT_TRUE(a.pixel.y() >= 0 && a.pixel.y() < kImageHeight);
  }
}

TEST(ExtractFeatures, KeepsKnownFeaturesFirstAndOthersAway) {
  const cv::Mat picture = TexturedPicture(kWidth, kImageHeight, SeedFromTestName());
  std::vector<Feature> known;
  for (const Feature& feature : Extract(picture)) {
    if (known.size() < 100 && feature.level < 3) known.push_back(feature);
  }
  const Descriptor before = known[0].descriptor;
  for (Feature& feature : known) {
    feature.pixel += Eigen::Vector2d(0.2, -0.1);  // less than half a pixel of its level
    feature.descriptor = {};
    feature.sigma_px = 0.3;
  }
  const std::vector<Feature> features = ExtractFeatures(picture, {}, 1000, known);
  ASSERT_GT(features.size(), 800U);
  for (std::size_t i = 0; i < known.size(); ++i) {
    EXPECT_EQ(features[i].pixel, known[i].pixel);
    EXPECT_EQ(features[i].level, known[i].level);
    EXPECT_EQ(features[i].sigma_px, 0.3);
    EXPECT_NE(features[i].descriptor, Descriptor{});
    for (std::size_t k = known.size(); k < features.size(); ++k) {
      EXPECT_GT((features[k].pixel - known[i].pixel).lpNorm<Eigen::Infinity>(), 4);
    }
  }
  EXPECT_EQ(features[0].descriptor, before);
  EXPECT_EQ(features.back().sigma_px, std::pow(1.2, features.back().level));
}

TEST(ExtractFeatures, FindsNothingInAnEmptyOrTinyPicture) {
  EXPECT_TRUE(Extract(cv::Mat(kImageHeight, kWidth, CV_8UC1, cv::Scalar(90))).empty());
  EXPECT_TRUE(Extract(TexturedPicture(40, 30, 1)).empty());
  EXPECT_TRUE(Extract(cv::Mat(1, 1, CV_8UC1, cv::Scalar(90))).empty());
}

TEST(ExtractFeatures, FollowsAPictureTurnedByAQuarter) {
  const cv::Mat picture = TexturedPicture(300, 300, SeedFromTestName());
  cv::Mat turned;
  cv::rotate(picture, turned, cv::ROTATE_90_CLOCKWISE);
  FeatureOptions one_level;
  one_level.num_levels = 1;  // smaller levels are sampled differently
  const std::vector<Feature> before = ExtractFeatures(picture, one_level, 10000);
  const std::vector<Feature> after = ExtractFeatures(turned, one_level, 10000);
  ASSERT_GT(before.size(), 200U);
  std::size_t num_alike = 0;
  for (const Feature& feature : before) {
    const Eigen::Vector2d expected(299 - feature.pixel.y(), feature.pixel.x());
    num_alike += std::any_of(after.begin(), after.end(), [&](const Feature& other) {
      return (other.pixel - expected).norm() < 0.5 &&
             Distance(other.descriptor, feature.descriptor) <= 50;
    });
  }
  // Cells lie elsewhere in the turned picture, so that some corners pass another threshold.
  EXPECT_GE(static_cast<double>(num_alike), 0.9 * static_cast<double>(before.size()));
}

// All over the image, on all levels.
std::vector<Feature> RandomExtractedFeatures(std::mt19937& random) {
  std::vector<Feature> features(500);
  for (Feature& feature : features) {
    feature.pixel = {Uniform(random, 0, kWidth - 1), Uniform(random, 0, kImageHeight - 1)};
    feature.level = static_cast<int>(random() % 8);
  }
  return features;
}

TEST(FeatureGrid, FindsWhatALookAtAllFinds) {
  std::mt19937 random(SeedFromTestName());
  const std::vector<Feature> features = RandomExtractedFeatures(random);
  const FeatureGrid grid(features, kWidth, kImageHeight);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d pixel(Uniform(random, -50, kWidth + 50),
                                Uniform(random, -50, kImageHeight + 50));
    const double radius = Uniform(random, 1, 120);
    std::vector<std::size_t> found;
    grid.Find(pixel, radius, 2, 5, found);
    std::sort(found.begin(), found.end());
    std::vector<std::size_t> expected;
    for (std::size_t k = 0; k < features.size(); ++k) {
      const bool near = (features[k].pixel - pixel).lpNorm<Eigen::Infinity>() <= radius;
      if (near && features[k].level >= 2 && features[k].level <= 5) expected.push_back(k);
    }
    ASSERT_EQ(found, expected);
  }
}

TEST(FeatureGrid, FindsAlongALineWhatALookAtAllFinds) {
  std::mt19937 random(SeedFromTestName());
  const std::vector<Feature> features = RandomExtractedFeatures(random);
  const FeatureGrid grid(features, kWidth, kImageHeight);
  std::size_t num_found = 0;
  for (int i = 0; i < 300; ++i) {
    Stripe stripe{{Uniform(random, -50, kWidth + 50), Uniform(random, -50, kImageHeight + 50)},
                  {Uniform(random, -50, kWidth + 50), Uniform(random, -50, kImageHeight + 50)},
                  Uniform(random, 1, 40),
                  2,
                  5};
    if (i % 4 == 1) stripe.last.x() = stripe.first.x();
    if (i % 4 == 2) stripe.last.y() = stripe.first.y();
    if (i % 20 == 3) stripe.last = stripe.first;
    const Eigen::Vector2d along = stripe.last - stripe.first;
    const double length = along.norm();
    const Eigen::Vector2d unit = length > 0 ? (along / length).eval() : Eigen::Vector2d(1, 0);
    std::vector<std::size_t> found;
    grid.FindAlong(stripe, found);
    std::sort(found.begin(), found.end());
    std::vector<std::size_t> expected;
    for (std::size_t k = 0; k < features.size(); ++k) {
      if (features[k].level < 2 || features[k].level > 5) continue;
      const Eigen::Vector2d from = features[k].pixel - stripe.first;
      const double at = unit.dot(from);
      if ((from - at * unit).norm() > stripe.radius_px) continue;
      if (at >= -stripe.radius_px && at <= length + stripe.radius_px) expected.push_back(k);
    }
    ASSERT_EQ(found, expected);
    num_found += found.size();
  }
  EXPECT_GT(num_found, 1000U);
}

// A point just before the camera has a pixel that no integer holds.
TEST(FeatureGrid, FindsNothingFarOutside) {
  std::mt19937 random(SeedFromTestName());
  const FeatureGrid grid(RandomExtractedFeatures(random), kWidth, kImageHeight);
  std::vector<std::size_t> found;
  for (const double far : {1e18, -1e18, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    grid.Find({far, far}, 20, 0, 7, found);
    grid.FindAlong({{far, 0}, {far, 10}, 20, 0, 7}, found);
    EXPECT_TRUE(found.empty());
  }
}

TEST(PyramidScales, OfADistanceThatNoPointHasAreThoseOfAnEnd) {
  const PyramidScales scales(FeatureOptions{});
  EXPECT_EQ(scales.Predict(0, 1), scales.num_levels() - 1);
  EXPECT_EQ(scales.Predict(1, 0), 0);
  EXPECT_EQ(scales.Nearest(0, 1), scales.num_levels() - 1);
  EXPECT_EQ(scales.Nearest(1, 0), 0);
}

TEST(PyramidScales, PredictsTheLevelOfADistance) {
  FeatureOptions options;
  options.scale_factor = 2;
  options.num_levels = 4;
  const PyramidScales scales(options);
  EXPECT_EQ(scales.Scale(3), 8);
  EXPECT_EQ(scales.Variance(1), 4);
  EXPECT_EQ(scales.Predict(8, 8), 0);    // as far as it shows on level 0
  EXPECT_EQ(scales.Predict(4.1, 8), 1);  // half as far: twice as large
  EXPECT_EQ(scales.Predict(0.1, 8), 3);  // no more levels
  EXPECT_EQ(scales.Predict(50, 8), 0);
}

}  // namespace
}  // namespace mono3d::tracking
