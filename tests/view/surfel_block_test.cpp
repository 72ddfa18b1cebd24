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
  a.error = 0.25F;
  a.first_frame = 20;
  b.first_frame = 10;
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
  // One octave below the largest radius: 20 steps; the last one of its frames.
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 6]), 235);
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 7]), 255);
  EXPECT_EQ(static_cast<unsigned char>(bytes[kBytesOfSurfel - at + 7]), 0);
  // (0, 3/7, -4/7) on the octahedron; its lower half is unfolded outwards: (4/7, 1).
  EXPECT_EQ(static_cast<signed char>(bytes[at + 8]), 73);
  EXPECT_EQ(static_cast<signed char>(bytes[at + 9]), 127);
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 10]), 255);
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 11]), 64);
  EXPECT_EQ(bytes.substr(at + 12, 3), std::string("\x0a\x14\x1e"));
  EXPECT_EQ(static_cast<unsigned char>(bytes[at + 15]), 128);
  EXPECT_EQ(Word(bytes, kBytesOfSurfel - at), 65535);
  EXPECT_EQ(static_cast<signed char>(bytes[kBytesOfSurfel - at + 8]), -128) << "no normal";
}

// As the page does it.
Eigen::Vector3f Unfolded(const std::string& bytes) {
  const float x = static_cast<float>(static_cast<signed char>(bytes[8])) / 127;
  const float y = static_cast<float>(static_cast<signed char>(bytes[9])) / 127;
  Eigen::Vector3f n(x, y, 1 - std::abs(x) - std::abs(y));
  if (n.z() < 0) {
    n.x() = (1 - std::abs(y)) * (x < 0 ? -1.0F : 1.0F);
    n.y() = (1 - std::abs(x)) * (y < 0 ? -1.0F : 1.0F);
  }
  return n.normalized();
}

TEST(SurfelBlock, KeepsTheDirectionOfANormal) {
  constexpr double kMaxAngle_rad = 0.0175;  // a degree: the steps of two bytes
  for (int i = 0; i < 2000; ++i) {
    // Evenly over the sphere.
    const double z = (2 * i + 1) / 2000.0 - 1, angle = 2.39996 * i;
    const double r = std::sqrt(1 - z * z);
    ViewSurfel surfel;
    surfel.normal = Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z).cast<float>();
    const Eigen::Vector3f kept = Unfolded(*MakeSurfelBlock({surfel}).surfels);
    EXPECT_LT(kept.cross(surfel.normal).norm(), kMaxAngle_rad) << surfel.normal.transpose();
    EXPECT_GT(kept.dot(surfel.normal), 0) << surfel.normal.transpose();
  }
}

TEST(SurfelBlock, KeepsRadiiOfDifferentSizes) {
  std::vector<ViewSurfel> surfels(2);
  surfels[0].radius = 3;
  constexpr double kHalfAStep = 1.0175;  // 2^(1/40)
  for (float radius = 3; radius > 3.0F / 6000; radius *= 0.9F) {
    surfels[1].radius = radius;
    const SurfelBlock block = MakeSurfelBlock(surfels);
    int code = 255;  // of the smaller one
    for (const std::size_t i : {0U, 1U}) {
      const auto byte = static_cast<unsigned char>((*block.surfels)[i * kBytesOfSurfel + 6]);
      code = std::min(code, static_cast<int>(byte));
    }
    const double kept = block.max_radius * std::exp2((code - 255) / 20.0);
    EXPECT_LT(std::max(kept / radius, radius / kept), kHalfAStep) << radius;
  }
  surfels[1].radius = 0;  // the smallest is still there
  const SurfelBlock block = MakeSurfelBlock(surfels);
  EXPECT_NE((*block.surfels)[6], 0);
  EXPECT_NE((*block.surfels)[kBytesOfSurfel + 6], 0);
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
  EXPECT_FALSE(certain[0].first_frame) << "not known is not frame 0";
  EXPECT_FALSE(MakeSurfelBlock(certain).frames);
  cloud.first_frames = {3, 0};
  EXPECT_EQ(ToViewSurfels(cloud, 0.5)[0].first_frame, 0U);
}

}  // namespace
}  // namespace mono3d::tools
