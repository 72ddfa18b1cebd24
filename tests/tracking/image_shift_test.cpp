// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/image_shift.h"

#include <gtest/gtest.h>

#include <random>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kNumShiftFeatures = 400;
constexpr int kMaxLevel = 3;

std::vector<Eigen::Vector2d> RandomShiftPixels(std::mt19937& random) {
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < kNumShiftFeatures; ++i) {
    pixels.emplace_back(Uniform(random, 0, 383), Uniform(random, 0, 223));
  }
  return pixels;
}

std::vector<char> All() { return std::vector<char>(kNumShiftFeatures, 1); }

// Shows what `a` shows elsewhere; what leaves the image is replaced by something else, and so is
// every second feature.
View Moved(const View& a, const Eigen::Vector2d& shift, std::mt19937& random) {
  View b = a;
  for (std::size_t i = 0; i < b.features.size(); ++i) {
    Feature& feature = b.features[i];
    feature.pixel += shift + Eigen::Vector2d(Normal(random, 3), Normal(random, 3));
    if (i % 2 == 0 && b.frame.camera.Contains(feature.pixel)) continue;
    feature.pixel = {Uniform(random, 0, 383), Uniform(random, 0, 223)};
    for (std::uint64_t& word : feature.descriptor) word ^= random() * 0x9e3779b97f4a7c15ULL;
  }
  return b;
}

TEST(CommonShift, FindsShiftsOfMoreThanHalfTheImage) {
  std::mt19937 random(SeedFromTestName());
  const View a = MakeView(SmallCamera(), RandomShiftPixels(random));
  // px: the mean of some dozen positions, each sure to 3 px.
  constexpr double kTolerance = 2;
  for (const Eigen::Vector2d& shift :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(-210, 20), Eigen::Vector2d(40, 120)}) {
    const auto found = CommonShift(a, All(), Moved(a, shift, random), kMaxLevel);
    ASSERT_TRUE(found.has_value()) << shift.transpose();
    EXPECT_LT((*found - shift).norm(), kTolerance) << shift.transpose();
  }
}

TEST(CommonShift, SaysNothingWhereNoneStandsOut) {
  std::mt19937 random(SeedFromTestName());
  const View a = MakeView(SmallCamera(), RandomShiftPixels(random));
  View scattered = a;
  for (Feature& feature : scattered.features) {
    feature.pixel = {Uniform(random, 0, 383), Uniform(random, 0, 223)};
  }
  EXPECT_FALSE(CommonShift(a, All(), scattered, kMaxLevel).has_value());
  View upside_down = a;
  for (Feature& feature : upside_down.features) {
    feature.pixel = Eigen::Vector2d(383, 223) - feature.pixel;
  }
  EXPECT_FALSE(CommonShift(a, All(), upside_down, kMaxLevel).has_value());
  EXPECT_FALSE(
      CommonShift(a, All(), MakeView(SmallCamera(), std::vector<Eigen::Vector2d>{}), kMaxLevel)
          .has_value());
}

TEST(CommonShift, AsksOnlyTheFeaturesAllowed) {
  std::mt19937 random(SeedFromTestName());
  const View a = MakeView(SmallCamera(), RandomShiftPixels(random));
  // Every second one goes one way, the others the other way.
  View b = a;
  std::vector<char> even(kNumShiftFeatures, 0);
  for (std::size_t i = 0; i < b.features.size(); ++i) {
    even[i] = i % 2 == 0 ? 1 : 0;
    b.features[i].pixel.x() += i % 2 == 0 ? 150 : -150;
  }
  const auto found = CommonShift(a, even, b, kMaxLevel);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->x(), 150, 1e-9);
  EXPECT_FALSE(CommonShift(a, std::vector<char>(kNumShiftFeatures, 0), b, kMaxLevel).has_value());
}

}  // namespace
}  // namespace mono3d::tracking
