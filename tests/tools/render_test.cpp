// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "mono3d/io/ply_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

// A green wall of 6 x 4 surfels, 10 su before the origin.
class RenderTool : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_render_tool_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    PointCloud wall;
    for (int i = 0; i < 24; ++i) {
      wall.points.emplace_back(static_cast<float>(i % 6) - 2.5F, static_cast<float>(i / 6) - 1.5F,
                               10.0F);
      wall.normals.emplace_back(0, 0, -1);
      wall.radii.push_back(0.8F);
      wall.colours.push_back({0, 200, 0});
    }
    WritePly(folder_ / "wall.ply", wall);
    WriteText(folder_ / "camera.yaml",
              "%YAML:1.0\n---\nimage_width: 80\nimage_height: 60\ncamera_matrix: !!opencv-matrix\n"
              "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 80., 0., 39.5, 0., 80., 29.5, 0., 0., "
              "1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n"
              "   data: [ 0., 0., 0., 0. ]\n");
    WriteText(folder_ / "poses.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 1 0 0\n2 0 0 4 0 0 0 1\n");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  CommandResult Render(const std::string& arguments) const {
    return RunCommand("cd " + folder_.string() + " && " MONO3D_RENDER_TOOL " " + arguments,
                      folder_);
  }

  std::filesystem::path folder_;
};

const cv::Vec3b kGreen(0, 200, 0);
const cv::Vec3b kWhite(255, 255, 255);

TEST_F(RenderTool, DrawsWhatOnePoseSees) {
  const CommandResult result =
      Render("wall.ply --camera camera.yaml --pose 0 0 0 0 0 0 1 -o seen.png");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const cv::Mat picture = cv::imread((folder_ / "seen.png").string());
  ASSERT_EQ(picture.size(), cv::Size(80, 60));
  EXPECT_EQ(picture.at<cv::Vec3b>(30, 40), kGreen);
  EXPECT_EQ(picture.at<cv::Vec3b>(2, 2), kWhite);
}

TEST_F(RenderTool, DrawsEachPoseOfATrajectory) {
  const CommandResult result =
      Render("wall.ply --camera camera.yaml --trajectory poses.txt --show depth -o pictures");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("3 pictures"));
  const cv::Mat first = cv::imread((folder_ / "pictures" / "000000.png").string());
  const cv::Mat turned = cv::imread((folder_ / "pictures" / "000001.png").string());
  EXPECT_NE(first.at<cv::Vec3b>(30, 40), kWhite);
  EXPECT_EQ(turned.at<cv::Vec3b>(30, 40), kWhite);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "pictures" / "000002.png"));
}

TEST_F(RenderTool, DrawsAnOverview) {
  const CommandResult result = Render("wall.ply --overview --width 120 -o overview.png");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const cv::Mat picture = cv::imread((folder_ / "overview.png").string());
  EXPECT_EQ(picture.cols, 120);
  cv::Mat green;
  cv::inRange(picture, cv::Scalar(0, 100, 0), cv::Scalar(50, 255, 50), green);
  EXPECT_GT(cv::countNonZero(green), 1000);
}

TEST_F(RenderTool, RefusesWhatItCannotDraw) {
  EXPECT_EQ(Render("wall.ply -o x.png").exit_status, 2);
  EXPECT_EQ(Render("wall.ply --overview --pose 0 0 0 0 0 0 1 -o x.png").exit_status, 2);
  EXPECT_EQ(Render("wall.ply --pose 0 0 0 0 0 0 1 -o x.png").exit_status, 2);
  EXPECT_EQ(Render("wall.ply --overview --show taste -o x.png").exit_status, 2);
  EXPECT_EQ(Render("wall.ply --overview --show confidence -o x.png").exit_status, 2);
  EXPECT_EQ(Render("missing.ply --overview -o x.png").exit_status, 1);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.png"));
}

}  // namespace
}  // namespace mono3d
