// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/isolated_surfels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace mono3d {
namespace {

void Add(PointCloud& cloud, const Eigen::Vector3f& point, float radius) {
  cloud.points.push_back(point);
  cloud.radii.push_back(radius);
}

// A wall of surfels half a radius apart.
PointCloud Wall(float scale) {
  PointCloud wall;
  for (int x = 0; x < 30; ++x) {
    for (int y = 0; y < 20; ++y) {
      Add(wall,
          scale * Eigen::Vector3f(0.5F * static_cast<float>(x), 0.5F * static_cast<float>(y), 7),
          scale);
    }
  }
  return wall;
}

TEST(IsolatedSurfels, AreNeverPartsOfAWallWhateverTheScale) {
  for (const float scale : {1e-3F, 1.0F, 1e3F}) {
    const std::vector<bool> is_isolated = FindIsolated(Wall(scale), 8);
    EXPECT_EQ(std::count(is_isolated.begin(), is_isolated.end(), true), 0) << scale;
  }
}

TEST(IsolatedSurfels, HaveFewerNeighboursThanAsked) {
  PointCloud cloud = Wall(1);
  const std::size_t wall_size = cloud.size();
  Add(cloud, {5, 5, -3.5F}, 1);  // 10.5 before it
  Add(cloud, {5, 5, 9.99F}, 1);  // 2.99 behind it, where it has a few within 3
  Add(cloud, {40, 5, 7}, 1);     // two, 2.9 apart
  Add(cloud, {42.9F, 5, 7}, 1);
  std::vector<bool> is_isolated = FindIsolated(cloud, 8);
  EXPECT_EQ(std::count(is_isolated.begin(), is_isolated.end(), true), 4);
  EXPECT_EQ(std::count(is_isolated.begin() + static_cast<std::ptrdiff_t>(wall_size),
                       is_isolated.end(), true),
            4);
  is_isolated = FindIsolated(cloud, 1);
  EXPECT_EQ(std::count(is_isolated.begin(), is_isolated.end(), true), 1);
  EXPECT_TRUE(is_isolated[wall_size]);
  is_isolated = FindIsolated(cloud, 0);
  EXPECT_EQ(std::count(is_isolated.begin(), is_isolated.end(), true), 0);
}

TEST(IsolatedSurfels, AreThoseOfASearchThroughAll) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> place(-6, 6);
  std::uniform_real_distribution<float> radius(0.1F, 1.2F);  // cells are wider and narrower
  PointCloud cloud;
  for (int i = 0; i < 1500; ++i) {
    Add(cloud, {place(random), place(random), place(random)}, radius(random));
  }
  constexpr int kMinNeighbours = 8;
  const std::vector<bool> is_isolated = FindIsolated(cloud, kMinNeighbours);
  int num_isolated = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    int count = -1;
    for (const Eigen::Vector3f& other : cloud.points) {
      const double within = kNeighbourRadii * cloud.radii[i];
      count += (other - cloud.points[i]).squaredNorm() <= within * within ? 1 : 0;
    }
    EXPECT_EQ(is_isolated[i], count < kMinNeighbours) << i;
    num_isolated += count < kMinNeighbours ? 1 : 0;
  }
  EXPECT_GT(num_isolated, 100);
  EXPECT_LT(num_isolated, 1400);
}

TEST(IsolatedSurfels, OneFarTooLargeIsKeptAtOnce) {
  PointCloud cloud = Wall(1);
  Add(cloud, {0, 0, -1e6F}, 1e5F);
  EXPECT_FALSE(FindIsolated(cloud, 8).back());
}

TEST(IsolatedSurfels, OfNoneAreNone) { EXPECT_TRUE(FindIsolated({}, 8).empty()); }

}  // namespace
}  // namespace mono3d
