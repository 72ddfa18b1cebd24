// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_search.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "evaluation/cloud_sampling.h"
#include "evaluation/cloud_scenes.h"
#include "evaluation/cloud_surface.h"

namespace mono3d {
namespace {

TEST(CloudSearch, FindsWhatTryingAllPointsFinds) {
  const std::vector<Eigen::Vector3d> points = CloudPoints(HouseCloud(3000, 1));
  const std::vector<Eigen::Vector3d> queries = CloudPoints(HouseCloud(500, 2));
  const std::vector<std::uint32_t> nearest = CloudSearch(points).Nearest(queries);
  constexpr double kFloatTolerance = 1e-5;  // the search is in floats, over 20 m
  for (std::size_t i = 0; i < queries.size(); ++i) {
    double smallest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& point : points) {
      smallest = std::min(smallest, (point - queries[i]).norm());
    }
    EXPECT_NEAR((points[nearest[i]] - queries[i]).norm(), smallest, kFloatTolerance);
  }
}

TEST(CloudSearch, GivesSeveralNearestFirst) {
  const std::vector<Eigen::Vector3d> points = {{5, 0, 0}, {1, 0, 0}, {3, 0, 0}};
  const std::vector<Eigen::Vector3d> queries = {{0, 0, 0}, {4.5, 0, 0}};
  const std::vector<std::uint32_t> expected = {1, 2, 0, 0, 2, 1};
  EXPECT_EQ(CloudSearch(points).Nearest(queries, 3), expected);
}

TEST(CloudSearch, BearsPointsInOnePlace) {
  const std::vector<Eigen::Vector3d> points(100, Eigen::Vector3d(1, 2, 3));
  EXPECT_LT(CloudSearch(points).Nearest(points)[50], 100U);
}

TEST(SampleEvenly, TakesAllWhenFewAndAboutAsManyAsWantedOfMany) {
  const std::vector<Eigen::Vector3d> points = CloudPoints(HouseCloud(10000, 3));
  EXPECT_EQ(SampleEvenly(points, 10000).size(), 10000U);
  const std::vector<std::uint32_t> sample = SampleEvenly(points, 1000);
  EXPECT_LE(sample.size(), 1000U);
  EXPECT_GE(sample.size(), 700U);
  EXPECT_LE(SampleEvenly(std::vector<Eigen::Vector3d>(50, points[0]), 10).size(), 10U);
}

// Nine tenths of the points in one corner take no more of the sample than their place does.
TEST(SampleEvenly, EvensOutDensity) {
  std::vector<Eigen::Vector3d> points = CloudPoints(HouseCloud(5000, 4));
  for (const Eigen::Vector3d& point : CloudPoints(HouseCloud(45000, 5))) {
    points.push_back(0.1 * point + Eigen::Vector3d(9, 9, 0));  // 1 % of the area
  }
  std::size_t in_corner = 0;
  const std::vector<std::uint32_t> sample = SampleEvenly(points, 1000);
  for (const std::uint32_t i : sample) in_corner += i >= 5000 ? 1 : 0;
  EXPECT_LT(in_corner, sample.size() / 10);
}

}  // namespace
}  // namespace mono3d
