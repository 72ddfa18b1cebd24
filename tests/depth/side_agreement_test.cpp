// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/side_agreement.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "depth/grey_images.h"
#include "depth/plane_scene.h"
#include "depth/sweep_geometry.h"

namespace mono3d {
namespace {

// Two things of which each differs from a third in a share p of its bits, independently.
double Independent(double p) { return 2 * p * (1 - p); }

TEST(AreUnrelated, WhereSidesHaveNothingInCommonButThatTheySuitTheReference) {
  for (const double chance : {0.31, 0.35, 0.4}) {
    EXPECT_TRUE(AreUnrelated({chance, chance, Independent(chance), chance})) << chance;
  }
}

// Every image has bits of what is there, a share q of them wrong by its own noise: all three pairs
// differ alike.
TEST(AreUnrelated, NotWhereNoiseAloneKeepsTheImagesApart) {
  for (const double noise : {0.02, 0.1, 0.2, 0.3}) {
    const double pair = Independent(noise);
    EXPECT_FALSE(AreUnrelated({pair, pair, pair, pair})) << noise;
  }
}

TEST(AreUnrelated, NotWhereWindowsAreNearlyTheSame) {
  EXPECT_FALSE(AreUnrelated({0.2, 0.2, Independent(0.2), 0.2}));
  EXPECT_FALSE(AreUnrelated({0, 0, 0, 0}));
}

TEST(AreUnrelated, OneSideThatDiffersIsEnoughToAsk) {
  const double independent = 0.1 + 0.4 - 2 * 0.1 * 0.4;
  EXPECT_TRUE(AreUnrelated({0.1, 0.4, independent, 0.4}));
  EXPECT_TRUE(AreUnrelated({0.4, 0.1, independent, 0.4}));
  EXPECT_FALSE(AreUnrelated({0.4, 0.1, 0.25, 0.4}));
}

// From noise that is independent in all images, 0, to sides that have nothing in common, 1.
double Independence(const SideDifferences& sides) {
  const double mean = 0.5 * (sides.before + sides.after);
  const double independent = sides.before + sides.after - 2 * sides.before * sides.after;
  return (sides.across - mean) / (independent - mean);
}

// A camera that rises before the ground: what is stretched from above is compressed from below.
TEST(MeasureSides, WindowsFollowASlantedSurface) {
  PlaneScene scene;
  scene.plane = {0, 1.5, 1};
  scene.direction = {0, -1, 0};
  scene.baseline = 0.4;
  const ImageBundle bundle = scene.Bundle();
  const SweepGeometry geometry(bundle);
  const GreyImages greys = GreyImagesOf(bundle);
  const Eigen::Vector3f n = -scene.plane.normalized().cast<float>();
  const cv::Mat normal(scene.TrueDepth().size(), CV_32FC3, cv::Scalar(n.x(), n.y(), n.z()));
  const auto follows = MeasureSides(greys, geometry, scene.TrueDepth(), normal);
  const auto upright = MeasureSides(greys, geometry, scene.TrueDepth(), 0 * normal);
  ASSERT_TRUE(follows && upright);
  EXPECT_LT(follows->worse, 0.7 * upright->worse);
  EXPECT_LT(Independence(*follows), 0.2);
  EXPECT_GT(Independence(*upright), 0.5);
}

}  // namespace
}  // namespace mono3d
