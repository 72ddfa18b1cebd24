// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/surfel_block.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <set>

namespace mono3d::tools {
namespace {

std::uint16_t Word(const std::string& bytes, std::size_t at) {
  std::uint16_t word = 0;
  std::memcpy(&word, bytes.data() + at, 2);
  return word;
}

TEST(SurfelBlock, HasTheSurfelsAsThePageReadsThem) {
  ViewSurfel a, b;
  a.point = {1, 2, 3};
  a.normal = {0, 0.6F, -0.8F};
  a.radius = 0.5F;
  a.colour = {10, 20, 30};
  a.confidence = 0.5F;
  a.observations = 1000;
  b.point = {2, 4, 7};
  b.radius = 1;
  const SurfelBlock block = MakeSurfelBlock({a, b});
  ASSERT_EQ(block.num_surfels(), 2);
  EXPECT_EQ(block.low, a.point);
  EXPECT_EQ(block.high, b.point);
  EXPECT_EQ(block.max_radius, 1);
  const std::string& bytes = *block.surfels;
  const std::size_t at = Word(bytes, 0) == 0 ? 0 : kBytesOfSurfel;
  EXPECT_EQ(Word(bytes, at + 4), 0);
  EXPECT_EQ(Word(bytes, at + 6), 32768);
  EXPECT_EQ(static_cast<signed char>(bytes[at + 8]), 0);
  EXPECT_EQ(static_cast<signed char>(bytes[at + 9]), 76);
  EXPECT_EQ(static_cast<signed char>(bytes[at + 10]), -102);
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 11]), 255);
  EXPECT_EQ(bytes.substr(at + 12, 3), std::string("\x0a\x14\x1e"));
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 15]), 128);
  EXPECT_EQ(Word(bytes, kBytesOfSurfel - at), 65535);
}

TEST(SurfelBlock, LeavesOutWhatIsNotFinite) {
  ViewSurfel good, bad, worse;
  bad.point.x() = std::numeric_limits<float>::quiet_NaN();
  worse.radius = std::numeric_limits<float>::infinity();
  EXPECT_EQ(MakeSurfelBlock({bad, good, worse}).num_surfels(), 1);
  EXPECT_EQ(MakeSurfelBlock({}).num_surfels(), 0);
}

// The first hundredth of a line lies all along it, and all of it is there.
TEST(SurfelBlock, BeginsWithACoarserOne) {
  std::vector<ViewSurfel> line(10000);
  for (std::size_t i = 0; i < line.size(); ++i) line[i].point.x() = static_cast<float>(i);
  const SurfelBlock block = MakeSurfelBlock(line);
  const std::string& bytes = *block.surfels;
  std::vector<int> tenths(10, 0);
  std::set<std::uint16_t> all;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const std::uint16_t x = Word(bytes, i * kBytesOfSurfel);
    all.insert(x);
    if (i < 200) ++tenths[std::min<std::size_t>(9, x / 6554U)];
  }
  EXPECT_EQ(all.size(), line.size());
  for (const int num : tenths) EXPECT_GT(num, 5);
}

TEST(SurfelBlock, TakesWhatACloudHas) {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  EXPECT_EQ(ToViewSurfels(cloud).size(), 2U);
  cloud.confidences = {0.1F, 0.9F};
  const std::vector<ViewSurfel> certain = ToViewSurfels(cloud, 0.5);
  ASSERT_EQ(certain.size(), 1U);
  EXPECT_EQ(certain[0].point, cloud.points[1]);
}

}  // namespace
}  // namespace mono3d::tools
