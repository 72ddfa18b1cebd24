// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/noise.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mono3d::synthetic {
namespace {

TEST(GradientNoise, IsZeroOnItsLattice) {
  EXPECT_EQ(GradientNoise(Eigen::Vector2f(3, -7), 5), 0);
  EXPECT_EQ(GradientNoise(Eigen::Vector3f(3, -7, 2), 5), 0);
}

TEST(GradientNoise, IsContinuousAcrossCells) {
  constexpr float kStep = 1e-3F;
  constexpr float kSteepest = 4;  // per cell: gradients of unit length, blended
  for (int i = 0; i < 2000; ++i) {
    const float x = -1 + kStep * static_cast<float>(i);
    const float a = GradientNoise(Eigen::Vector2f(x, 0.37F), 9);
    const float b = GradientNoise(Eigen::Vector2f(x + kStep, 0.37F), 9);
    EXPECT_LT(std::abs(a - b), kSteepest * kStep);
  }
}

// A pixel of no size, as of a camera on the very surface, has no last octave.
TEST(FractalNoise, EndsWithCellsAndPixelsOfNoSize) {
  FractalOptions options;
  options.smallest_cell_m = 0;
  EXPECT_TRUE(std::isfinite(FractalNoise(Eigen::Vector2f(0.3F, 0.6F), options, 0)));
}

TEST(FractalNoise, LeavesOutWhatThePixelCannotResolve) {
  const FractalOptions options{1, 0, 1, 3};
  EXPECT_EQ(FractalNoise(Eigen::Vector2f(0.3F, 0.6F), options, 2), 0);
  EXPECT_NE(FractalNoise(Eigen::Vector2f(0.3F, 0.6F), options, 0.1F), 0);
  EXPECT_EQ(ResolvedShare(1, 0.1F), 1);
}

TEST(RandomNumbers, FollowTheSeed) {
  RandomNumbers a(4);
  RandomNumbers b(4);
  RandomNumbers c(5);
  const std::uint32_t first = a.Bits();
  EXPECT_EQ(first, b.Bits());
  EXPECT_NE(first, c.Bits());
  for (int i = 0; i < 100; ++i) {
    const double value = a.Uniform(-2, 3);
    EXPECT_GE(value, -2);
    EXPECT_LT(value, 3);
  }
}

}  // namespace
}  // namespace mono3d::synthetic
