// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/splat_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"

namespace mono3d {
namespace {

class SplatFileTest : public TemporaryFolderTest {
 protected:
  static PointCloud TwoSurfels() {
    PointCloud cloud;
    cloud.points = {{1, 2, 3}, {4, 5, 6}};
    cloud.normals = {{0, 0, 1}, Eigen::Vector3f(1, 2, -2).normalized()};
    cloud.colours = {{255, 0, 128}, {10, 20, 30}};
    cloud.radii = {.5F, .02F};
    cloud.confidences = {.75F, 1.F};
    return cloud;
  }
};

TEST_F(SplatFileTest, HasADiscForEachSurfel) {
  const PointCloud cloud = TwoSurfels();
  WriteSplats(folder_ / "splats.ply", cloud);
  const std::string bytes = ReadText(folder_ / "splats.ply");
  const std::string end = "end_header\n";
  const std::size_t begin = bytes.find(end) + end.size();
  std::array<std::array<float, 17>, 2> splats{};
  ASSERT_EQ(bytes.size(), begin + sizeof(splats));
  std::memcpy(&splats, bytes.data() + begin, sizeof(splats));
  EXPECT_EQ(splats[0][2], 3);
  EXPECT_NEAR(.5 + .2820948 * splats[0][6], 1, 1e-5);  // red
  EXPECT_NEAR(.5 + .2820948 * splats[0][7], 0, 1e-5);
  EXPECT_NEAR(1 / (1 + std::exp(-splats[0][9])), .75, 1e-5);
  EXPECT_NEAR(1 / (1 + std::exp(-splats[1][9])), .99, 1e-5);  // never quite opaque
  EXPECT_NEAR(std::exp(splats[0][10]), .25, 1e-5);
  EXPECT_NEAR(std::exp(splats[0][11]), .25, 1e-5);
  EXPECT_NEAR(std::exp(splats[0][12]), .025, 1e-5);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& splat = splats.at(i);
    const Eigen::Quaternionf rotation(splat[13], splat[14], splat[15], splat[16]);
    EXPECT_NEAR(rotation.norm(), 1, 1e-5);
    EXPECT_NEAR((rotation * Eigen::Vector3f::UnitZ() - cloud.normals[i]).norm(), 0, 1e-5);
  }
  EXPECT_EQ(ReadPly(folder_ / "splats.ply").normals[1], cloud.normals[1]);
}

TEST_F(SplatFileTest, OfAModelIsTheSameBlockByBlock) {
  WritePly(folder_ / "model.ply", TwoSurfels());
  WriteSplatsOf(folder_ / "model.ply", folder_ / "of_model.ply");
  WriteSplats(folder_ / "splats.ply", ReadPly(folder_ / "model.ply"));
  EXPECT_EQ(ReadText(folder_ / "of_model.ply"), ReadText(folder_ / "splats.ply"));
}

TEST_F(SplatFileTest, RefusesWhatHasNoDiscs) {
  PointCloud cloud = TwoSurfels();
  cloud.radii.clear();
  EXPECT_THROW(WriteSplats(folder_ / "splats.ply", cloud), Error);
  cloud = TwoSurfels();
  cloud.radii[1] = 0;
  EXPECT_THROW(WriteSplats(folder_ / "splats.ply", cloud), Error);
  EXPECT_THROW(WriteSplats(folder_ / "splats.ply", {}), Error);
}

}  // namespace
}  // namespace mono3d
