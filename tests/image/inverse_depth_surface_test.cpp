// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/inverse_depth_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace mono3d {
namespace {

constexpr int kWidth = 300;
constexpr int kHeight = 200;

using InverseDepthFunction = std::function<double(const Eigen::Vector2d& pixel)>;

std::vector<InverseDepthSample> SamplesOf(const InverseDepthFunction& inverse_depth,
                                          int num_samples) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(0, kWidth - 1);
  std::uniform_real_distribution<double> y(0, kHeight - 1);
  std::vector<InverseDepthSample> samples;
  for (int i = 0; i < num_samples; ++i) {
    const Eigen::Vector2d pixel(x(random), y(random));
    samples.push_back({pixel, inverse_depth(pixel)});
  }
  return samples;
}

double LargestError(const InverseDepthSurface& surface, const InverseDepthFunction& truth) {
  double largest = 0;
  for (double y = 0; y < kHeight; y += 7) {
    for (double x = 0; x < kWidth; x += 7) {
      largest = std::max(largest, std::abs(surface.At({x, y}) - truth({x, y})));
    }
  }
  return largest;
}

double OfPlane(const Eigen::Vector2d& pixel) { return 0.1 + 1e-4 * pixel.x() - 2e-4 * pixel.y(); }

TEST(InverseDepthSurface, MeetsAPlaneExactly) {
  EXPECT_LT(LargestError({kWidth, kHeight, SamplesOf(OfPlane, 60)}, OfPlane), 1e-4);
  // Its unit does not matter.
  const auto near = [](const Eigen::Vector2d& pixel) { return 1e6 * OfPlane(pixel); };
  EXPECT_LT(LargestError({kWidth, kHeight, SamplesOf(near, 60)}, near), 1e2);
}

TEST(InverseDepthSurface, IsFlatAsFarAsFewPointsTellNothingElse) {
  const InverseDepthSurface constant(0.25);
  EXPECT_EQ(constant.At({17, 4}), 0.25);
  const InverseDepthSurface of_one(kWidth, kHeight, {{{250, 10}, 0.25}});
  EXPECT_NEAR(of_one.At({0, 199}), 0.25, 1e-9);
  // Two points close to each other that differ by 2 % would make the other end negative.
  const InverseDepthSurface of_two(kWidth, kHeight, {{{250, 10}, 0.2475}, {{252, 10}, 0.2525}});
  EXPECT_NEAR(of_two.At({0, 199}), 0.25, 0.02);
}

TEST(InverseDepthSurface, FollowsWhatIsWiderThanItsCells) {
  const auto hill = [](const Eigen::Vector2d& pixel) {
    return 0.1 +
           0.05 * std::exp(-(pixel - Eigen::Vector2d(150, 100)).squaredNorm() / (2 * 50 * 50));
  };
  EXPECT_LT(LargestError({kWidth, kHeight, SamplesOf(hill, 800)}, hill), 0.005);
}

// Behind the horizon of a plane there is the sky.
TEST(InverseDepthSurface, IsNeverNegative) {
  const auto ground = [](const Eigen::Vector2d& pixel) { return 1e-3 * (pixel.y() - 50); };
  std::vector<InverseDepthSample> samples = SamplesOf(ground, 200);
  std::erase_if(samples, [](const auto& sample) { return sample.inverse_depth < 0.01; });
  const InverseDepthSurface surface(kWidth, kHeight, samples);
  EXPECT_NEAR(surface.At({100, 55}), 0.005, 2e-4);
  EXPECT_EQ(surface.At({100, 10}), 0);
}

TEST(InverseDepthSurface, LeavesOutPointsThatDoNotAgreeWithTheOthers) {
  std::vector<InverseDepthSample> samples = SamplesOf(OfPlane, 300);
  for (std::size_t i = 0; i < samples.size(); i += 8) {
    samples[i].inverse_depth *= i % 16 == 0 ? 10 : 0.05;
  }
  EXPECT_LT(LargestError({kWidth, kHeight, samples}, OfPlane), 0.003);
}

TEST(InverseDepthSurface, OfAnImageOfOnePixelIsAsGoodAsAny) {
  EXPECT_NEAR(InverseDepthSurface(1, 1, {{{0, 0}, 0.5}}).At({0, 0}), 0.5, 1e-9);
}

}  // namespace
}  // namespace mono3d
