// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/las_file.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"

namespace mono3d {
namespace {

template <typename T>
T LasValue(const std::string& bytes, std::size_t at) {
  T value{};
  if (at + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

PointCloud ThreeSurfels() {
  PointCloud cloud;
  cloud.points = {{10, 20, 30}, {-11.5F, 21.25F, 31}, {12, -22, 29.125F}};
  cloud.normals = {{0, 0, 1}, {0, 0.6F, 0.8F}, {1, 0, 0}};
  cloud.colours = {{255, 0, 1}, {1, 2, 3}, {128, 129, 130}};
  cloud.radii = {0.05F, 0.06F, 0.04F};
  cloud.confidences = {0.25F, 0.5F, 1};
  cloud.observations = {1, 2, 3};
  return cloud;
}

class ModelFileTest : public TemporaryFolderTest {
 protected:
  // Of the three surfels, with a coordinate system where there is one.
  void Write(const MapAxes& axes) {
    WritePly(folder_ / "model.ply", ThreeSurfels());
    MapSurfels surfels(folder_ / "model.ply", axes);
    WriteLas(folder_ / "model.las", surfels, axes);
    WriteLocalPly(folder_ / "local.ply", surfels, axes);
    las_ = ReadText(folder_ / "model.las");
  }
  // As a program that reads LAS finds it, by the header.
  Eigen::Vector3d LasPoint(std::size_t i) const {
    const std::size_t at =
        LasValue<std::uint32_t>(las_, 96) + i * LasValue<std::uint16_t>(las_, 105);
    Eigen::Vector3d point;
    for (int k = 0; k < 3; ++k) {
      const auto index = static_cast<std::size_t>(k);
      point[k] =
          LasValue<std::int32_t>(las_, at + 4 * index) * LasValue<double>(las_, 131 + 8 * index) +
          LasValue<double>(las_, 155 + 8 * index);
    }
    return point;
  }

  std::string las_;
};

TEST_F(ModelFileTest, HasTheFieldsOfLas14) {
  Write({});
  EXPECT_EQ(las_.substr(0, 4), "LASF");
  EXPECT_EQ(LasValue<std::uint16_t>(las_, 6) & 16, 16);  // coordinate systems as WKT
  EXPECT_EQ(LasValue<std::uint8_t>(las_, 24), 1);
  EXPECT_EQ(LasValue<std::uint8_t>(las_, 25), 4);
  EXPECT_EQ(LasValue<std::uint16_t>(las_, 94), 375);
  EXPECT_EQ(LasValue<std::uint32_t>(las_, 100), 1u);  // the extra bytes alone
  EXPECT_EQ(LasValue<std::uint8_t>(las_, 104), 7);
  EXPECT_EQ(LasValue<std::uint16_t>(las_, 105), 36 + 5 * 4);
  EXPECT_EQ(LasValue<std::uint64_t>(las_, 247), 3u);
  EXPECT_EQ(LasValue<std::uint32_t>(las_, 96), 375u + 54 + 5 * 192);
  EXPECT_EQ(las_.size(), 375u + 54 + 5 * 192 + 3 * 56);
  EXPECT_EQ(LasValue<double>(las_, 131), 0.001);  // below a tenth of 0.05
  EXPECT_NEAR(LasValue<double>(las_, 179), 12, 1e-3);
  EXPECT_NEAR(LasValue<double>(las_, 187), -11.5, 1e-3);
}

TEST_F(ModelFileTest, HasPointsColoursAndExtraBytes) {
  Write({});
  const PointCloud cloud = ThreeSurfels();
  const std::size_t points = LasValue<std::uint32_t>(las_, 96);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((LasPoint(i) - cloud.points[i].cast<double>()).cwiseAbs().maxCoeff(), 5.1e-4);
    const std::size_t at = points + 56 * i;
    EXPECT_EQ(LasValue<std::uint8_t>(las_, at + 14), 0x11);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(LasValue<std::uint16_t>(las_, at + 30 + 2 * k), 257 * cloud.colours[i][k]);
      EXPECT_FLOAT_EQ(LasValue<float>(las_, at + 44 + 4 * k),
                      cloud.normals[i][static_cast<int>(k)]);
    }
    EXPECT_EQ(LasValue<float>(las_, at + 36), cloud.confidences[i]);
    EXPECT_EQ(LasValue<float>(las_, at + 40), cloud.radii[i]);
  }
  EXPECT_EQ(las_.substr(375 + 54 + 4, 10), "confidence");
}

TEST_F(ModelFileTest, IsOnTheMap) {
  if (!CoordinateSystem::IsSupported()) GTEST_SKIP() << "built without PROJ";
  const MapAxes axes(CoordinateSystem("EPSG:25832", {49.01, 8.41, 115}, true));
  Write(axes);
  const PointCloud cloud = ThreeSurfels();
  EXPECT_EQ(LasValue<std::uint32_t>(las_, 100), 2u);
  EXPECT_NE(las_.find("PROJCS[\"ETRS89 / UTM zone 32N\""), std::string::npos);
  const std::string ply = ReadText(folder_ / "local.ply");
  EXPECT_NE(ply.find("comment crs ETRS89 / UTM zone 32N\ncomment offset 456000 5428000 0\n"),
            std::string::npos);
  const PointCloud local = ReadPly(folder_ / "local.ply");
  ASSERT_EQ(local.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d exact = axes.ToMap(cloud.points[i].cast<double>());
    EXPECT_LT((LasPoint(i) - exact).cwiseAbs().maxCoeff(), 6e-4);
    const Eigen::Vector3d in_ply =
        local.points[i].cast<double>() + Eigen::Vector3d(456'000, 5'428'000, 0);
    EXPECT_LT((in_ply - exact).norm(), 3e-4);
  }
  EXPECT_EQ(local.colours, cloud.colours);
  EXPECT_EQ(local.observations, cloud.observations);
}

TEST_F(ModelFileTest, IsReadBlockByBlock) {
  PointCloud cloud;
  constexpr std::size_t kCount = 70'000;
  for (std::size_t i = 0; i < kCount; ++i) {
    cloud.points.emplace_back(static_cast<float>(i % 1000), static_cast<float>(i % 10), 0.F);
    cloud.radii.push_back(i == kCount - 1 ? 9.F : 0.5F);
  }
  cloud.points[16 * 100] = {1e6F, 0, 0};  // far away
  WritePly(folder_ / "model.ply", cloud);
  const MapAxes axes;
  MapSurfels surfels(folder_ / "model.ply", axes);
  ASSERT_EQ(surfels.num_blocks(), 2u);
  MapSurfelBlock block;
  surfels.Read(1, block);
  ASSERT_EQ(block.points.size(), kCount - 65'536);
  EXPECT_EQ(block.points[0], cloud.points[65'536].cast<double>());
  EXPECT_EQ(surfels.max_radius(0), 0.5);
  EXPECT_EQ(surfels.max_radius(1), 9);
  EXPECT_EQ(surfels.median_radius(), 0.5);
  EXPECT_EQ(surfels.bounds().max().x(), 1e6);
  EXPECT_LT(surfels.BoundsOfMost().max().x(), 1e6);
}

TEST_F(ModelFileTest, RefusesAnEmptyModel) {
  WritePly(folder_ / "model.ply", {});
  const MapAxes axes;
  EXPECT_THROW(MapSurfels(folder_ / "model.ply", axes), Error);
}

// What is no number would be a place anywhere.
TEST_F(ModelFileTest, SurfelsThatAreNoneAreRefused) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t what = 0; what < 4; ++what) {
    WritePly(folder_ / "model.ply", ThreeSurfels());
    std::string bytes = ReadText(folder_ / "model.ply");
    // Of the second surfel: y, ny, radius, confidence.
    constexpr std::array<std::size_t, 4> kPlaces = {4, 16, 27, 31};
    const std::size_t values = bytes.find("end_header\n") + std::strlen("end_header\n");
    const std::size_t surfel = values + (bytes.size() - values) / 3;
    bytes.replace(surfel + kPlaces.at(what), sizeof none, reinterpret_cast<const char*>(&none),
                  sizeof none);
    WriteText("model.ply", bytes);
    EXPECT_THROW(MapSurfels(folder_ / "model.ply", MapAxes()), Error) << what;
  }
}

}  // namespace
}  // namespace mono3d
