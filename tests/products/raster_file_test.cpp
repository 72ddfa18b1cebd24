// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/raster_file.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/products/surface_model.h"

namespace mono3d {
namespace {

constexpr RasterGrid kSmallGrid = {
    .west = 456'000, .north = 5'428'000, .cell = 0.5, .width = 40, .height = 30};

class RasterFileTest : public TemporaryFolderTest {
 protected:
  void SetUp() override {
    if (!RasterFile::IsSupported()) GTEST_SKIP() << "built without GDAL";
    if (CoordinateSystem::IsSupported()) {
      axes_ = MapAxes(CoordinateSystem("EPSG:25832", {49, 8.4, 100}, true));
    }
  }
  std::size_t NumFiles() const {
    const std::filesystem::directory_iterator files(folder_);
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }

  MapAxes axes_;
};

TEST_F(RasterFileTest, WritesHeights) {
  cv::Mat part(10, 20, CV_32FC1, cv::Scalar(12.5F));
  part.at<float>(3, 4) = 13.25F;
  {
    RasterFile file(folder_ / "dsm.tif", kSmallGrid, axes_, RasterForm::kHeights);
    file.Write({5, 6, 20, 10}, part);
    EXPECT_EQ(file.Read({9, 9, 1, 1}).at<float>(0, 0), 13.25F);
    EXPECT_EQ(file.Read({0, 0, 1, 1}).at<float>(0, 0), kNoHeight);
    file.Finish();
  }
  EXPECT_EQ(NumFiles(), 1u);
  // By another reader than GDAL.
  const cv::Mat read = cv::imread((folder_ / "dsm.tif").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.type(), CV_32FC1);
  EXPECT_EQ(read.size(), cv::Size(40, 30));
  EXPECT_EQ(read.at<float>(9, 9), 13.25F);
  EXPECT_EQ(read.at<float>(15, 24), 12.5F);
  EXPECT_EQ(read.at<float>(16, 24), kNoHeight);
  if (CoordinateSystem::IsSupported()) {
    EXPECT_NE(ReadText(folder_ / "dsm.tif").find("ETRS89 / UTM zone 32N"), std::string::npos);
  }
}

TEST_F(RasterFileTest, WritesPicturesWithAlpha) {
  RasterFile file(folder_ / "map.tif", kSmallGrid, axes_, RasterForm::kPicture);
  file.Write({0, 0, 2, 1}, cv::Mat(1, 2, CV_8UC4, cv::Scalar(10, 20, 30, 255)));
  file.Finish();
  const cv::Mat read = cv::imread((folder_ / "map.tif").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.type(), CV_8UC4);
  EXPECT_EQ(read.at<cv::Vec4b>(0, 1), cv::Vec4b(30, 20, 10, 255));
  EXPECT_EQ(read.at<cv::Vec4b>(5, 5)[3], 0);
}

TEST_F(RasterFileTest, FillsNearHoles) {
  RasterFile file(folder_ / "dsm.tif", kSmallGrid, axes_, RasterForm::kHeights);
  file.Write({0, 0, 10, 30}, cv::Mat(30, 10, CV_32FC1, cv::Scalar(7)));
  file.Fill(4);
  EXPECT_NEAR(file.Read({12, 15, 1, 1}).at<float>(0, 0), 7, 1e-5);
  EXPECT_EQ(file.Read({20, 15, 1, 1}).at<float>(0, 0), kNoHeight);
}

TEST_F(RasterFileTest, DrawsContours) {
  RasterFile file(folder_ / "dsm.tif", kSmallGrid, axes_, RasterForm::kHeights);
  cv::Mat slope(30, 40, CV_32FC1);
  for (int row = 0; row < 30; ++row) slope.row(row).setTo(0.1F * static_cast<float>(row));
  file.Write({0, 0, 40, 30}, slope);
  file.WriteContours(folder_ / "contours.gpkg", 1);
  EXPECT_EQ(ReadText(folder_ / "contours.gpkg").substr(0, 15), "SQLite format 3");
  EXPECT_EQ(NumFiles(), 2u);  // and the cells of the raster, until it is gone
}

TEST_F(RasterFileTest, LeavesNothingBehind) {
  {
    RasterFile file(folder_ / "dsm.tif", kSmallGrid, axes_, RasterForm::kHeights);
    EXPECT_EQ(NumFiles(), 1u);
  }
  EXPECT_EQ(NumFiles(), 0u);
  EXPECT_THROW(RasterFile(folder_ / "no" / "dsm.tif", kSmallGrid, axes_, RasterForm::kHeights),
               Error);
}

}  // namespace
}  // namespace mono3d
