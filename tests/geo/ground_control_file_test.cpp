// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/ground_control_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

class GroundControlFileTest : public TemporaryFolderTest {
 protected:
  GroundControlFile Read(const std::string& text) const {
    const std::filesystem::path path = folder_ / "gcp.txt";
    std::ofstream(path, std::ios::binary) << text;
    return ReadGroundControlFile(path);
  }
  std::string Refusal(const std::string& text) const {
    try {
      (void)Read(text);
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  }
};

TEST_F(GroundControlFileTest, JoinsTheMarksOfAPoint) {
  const GroundControlFile file = Read(
      "EPSG:25832\r\n"
      "# easting northing height\n"
      "\n"
      "544256.7 5320919.9 5 3044.5 2622 IMG_0525.jpg gcp01\n"
      "544157.7\t5320899.2\t4.5\t4193\t1552\tflight/IMG_0585.jpg\tgcp02\textra\n"
      "544256.7 5320919.9 5 1606 2763 IMG_0527.jpg gcp01\n");
  EXPECT_EQ(file.system, "EPSG:25832");
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[0].name, "gcp01");
  EXPECT_EQ(file.points[0].x, 544256.7);
  EXPECT_EQ(file.points[0].y, 5320919.9);
  EXPECT_EQ(file.points[0].z, 5.0);
  ASSERT_EQ(file.points[0].marks.size(), 2U);
  EXPECT_EQ(file.points[0].marks[0].pixel, Eigen::Vector2d(3044.5, 2622));
  EXPECT_EQ(file.points[0].marks[1].image, "IMG_0527.jpg");
  EXPECT_EQ(file.points[0].marks[1].line, 6U);
  EXPECT_EQ(file.points[1].marks[0].image, "IMG_0585.jpg");
  EXPECT_FALSE(file.points[1].is_check);
  EXPECT_EQ(file.num_unreadable, 0U);
}

TEST_F(GroundControlFileTest, KnowsTheWaysInWhichASystemIsWritten) {
  const std::string row = "\n8.41 49.01 110 1 2 a.jpg\n";
  EXPECT_EQ(Read("WGS84 UTM 32N" + row).system, "EPSG:32632");
  EXPECT_EQ(Read("wgs84 utm 7s" + row).system, "EPSG:32707");
  EXPECT_EQ(Read("WGS84" + row).system, "EPSG:4326");
  EXPECT_EQ(Read("epsg:4326" + row).system, "EPSG:4326");
  const std::string proj = "+proj=utm +zone=10 +ellps=WGS84 +datum=WGS84 +units=m +no_defs";
  EXPECT_EQ(Read(proj + row).system, proj);
  const GroundControlFile local = Read("ENU 49.01 8.41 115" + row);
  EXPECT_EQ(local.system, "ENU");
  ASSERT_TRUE(local.origin.has_value());
  EXPECT_EQ(local.origin->longitude_deg, 8.41);
  EXPECT_TRUE(IsWgs84("EPSG:4326"));
  EXPECT_FALSE(IsWgs84("EPSG:32632"));
}

TEST_F(GroundControlFileTest, AHeightMayBeMissing) {
  const GroundControlFile file = Read(
      "EPSG:25832\n"
      "100 200 nan 1 2 a.jpg p1\n"
      "100 201 - 1 2 a.jpg p2\n"
      "100 202 1.5 2.5 a.jpg p3\n"
      "100 203 7 1 2 000123 p4\n");
  ASSERT_EQ(file.points.size(), 4U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_FALSE(file.points[i].z.has_value()) << i;
  EXPECT_EQ(file.points[2].marks[0].pixel, Eigen::Vector2d(1.5, 2.5));
  EXPECT_EQ(file.points[2].name, "p3");
  EXPECT_EQ(file.points[3].z, 7.0);
  EXPECT_EQ(file.points[3].marks[0].image, "000123");
}

TEST_F(GroundControlFileTest, PointsWithoutANameAreTellApartByTheirPlace) {
  const GroundControlFile file =
      Read("EPSG:25832\n1 2 3 10 20 a.jpg\n1 2 4 10 20 b.jpg\n1 2 3 10 20 c.jpg\n");
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[0].name, "point 1");
  EXPECT_EQ(file.points[0].marks.size(), 2U);
  EXPECT_EQ(file.points[1].name, "point 2");
}

TEST_F(GroundControlFileTest, AFurtherColumnMakesACheckPoint) {
  const GroundControlFile file = Read(
      "EPSG:25832\n1 2 3 10 20 a.jpg p check\n4 2 3 10 20 a.jpg q\n1 2 3 10 20 b.jpg p\n"
      "7 2 3 10 20 a.jpg r\n7 2 3 10 20 b.jpg r 0.5 CHECK\n");
  ASSERT_EQ(file.points.size(), 3U);
  EXPECT_TRUE(file.points[0].is_check);
  EXPECT_FALSE(file.points[1].is_check);
  EXPECT_TRUE(file.points[2].is_check);
}

TEST_F(GroundControlFileTest, CountsLinesThatMakeNoSense) {
  const GroundControlFile file = Read(
      "EPSG:25832\n1 2 3 10 20 a.jpg p\nx y z px py image\n1 2 3 10\n9 2 3 10 20 b.jpg p\n"
      "1 2 3 11 21 a.jpg p\n");
  EXPECT_EQ(file.points.size(), 1U);
  EXPECT_EQ(file.points[0].marks.size(), 1U);
  EXPECT_EQ(file.num_unreadable, 4U);
  EXPECT_THAT(file.first_unreadable, HasSubstr("line 3"));
}

TEST_F(GroundControlFileTest, SaysWhyItRefuses) {
  EXPECT_THAT(Refusal("1 2 3 10 20 a.jpg\n"), HasSubstr("gcp.txt:1"));
  EXPECT_THAT(Refusal("1 2 3 10 20 a.jpg\n"), HasSubstr("coordinate system"));
  EXPECT_THAT(Refusal("WGS84 UTM 99N\n1 2 3 10 20 a.jpg\n"), HasSubstr("coordinate system"));
  EXPECT_THAT(Refusal("ENU north\n1 2 3 10 20 a.jpg\n"), HasSubstr("latitude"));
  EXPECT_THAT(Refusal("EPSG:25832\n"), HasSubstr("no ground control point"));
  EXPECT_THAT(Refusal("EPSG:25832\n1 2\n"), HasSubstr("line 2"));
  EXPECT_THAT(Refusal(""), HasSubstr("no ground control point"));
}

}  // namespace
}  // namespace mono3d
