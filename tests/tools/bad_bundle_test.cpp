// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Bundles without depth in them, or in parts of them, through mono3d-depth: exit status 1 and the
// reason on stderr and in bundle.json, or files without bad numbers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "mono3d/io/pfm_file.h"
#include "mono3d/io/ply_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr int kBundleWidth = 96;
constexpr int kBundleHeight = 72;
constexpr int kShift_px = 4;  // from image to image

std::string BundleCameraText(double fx) {
  return "%YAML:1.0\n---\nimage_width: " + std::to_string(kBundleWidth) +
         "\nimage_height: " + std::to_string(kBundleHeight) +
         "\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ " +
         std::to_string(fx) +
         ", 0., 47.5, 0., 100., 35.5, 0., 0., 1. ]\n"
         "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
         "   data: [ 0., 0., 0., 0., 0. ]\n";
}

// A wall 10 away, past which the camera flies sideways, 0.4 from image to image: its pictures are
// windows of one texture, moved by fx * 0.4 / 10 = 4 px.
class BadBundleTool : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_bad_bundle_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "images");
    texture_ = cv::Mat(kBundleHeight, kBundleWidth + 8 * kShift_px, CV_8UC3);
    cv::RNG random(7);
    random.fill(texture_, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(texture_, texture_, {}, 1);
    WriteText(folder_ / "camera.yaml", BundleCameraText(100));
    WriteImages(5);
    WritePoses(5, 0.4);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  cv::Mat Picture(int i) const {
    return texture_(cv::Rect(i * kShift_px, 0, kBundleWidth, kBundleHeight)).clone();
  }
  void WriteImage(int i, const cv::Mat& image) const {
    cv::imwrite((folder_ / "images" / (std::to_string(i) + ".png")).string(), image);
  }
  void WriteImages(int num_images) const {
    for (int i = 0; i < num_images; ++i) WriteImage(i, Picture(i));
  }
  // `turn` of all but the middle one, as qy and qw.
  void WritePoses(int num_images, double step_su, const std::string& turn = "0 0 0 1") const {
    std::string poses;
    for (int i = 0; i < num_images; ++i) {
      poses += std::to_string(i) + " " + std::to_string(step_su * i) + " 0 0 " +
               (i == num_images / 2 ? "0 0 0 1" : turn) + "\n";
    }
    WriteText(folder_ / "poses.txt", poses);
  }

  CommandResult Depth(const std::string& extra = {}) const {
    return RunCommand(std::string(MONO3D_DEPTH_TOOL) + " " + (folder_ / "images").string() +
                          " --camera " + (folder_ / "camera.yaml").string() + " --poses " +
                          (folder_ / "poses.txt").string() + " -o " + (folder_ / "out").string() +
                          " " + extra,
                      folder_);
  }

  void ExpectNoDepth(const std::string& reason, const std::string& extra = {}) const {
    const CommandResult result = Depth(extra);
    EXPECT_EQ(result.exit_status, 1) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("mono3d-depth: error: no depth: " + reason));
    const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/bundle.json"));
    EXPECT_EQ(record.at("status"), "rejected");
    EXPECT_THAT(record.at("reason").get<std::string>(), HasSubstr(reason));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/2.depth.pfm"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/cloud.ply"));
  }

  // The depth; the files hold no NaN and no infinity.
  cv::Mat DepthOfGoodFiles(const std::string& name, const std::string& extra = {}) const {
    const CommandResult result = Depth(extra);
    EXPECT_EQ(result.exit_status, 0) << result.errors;
    const std::string stem = (folder_ / "out" / name).string();
    for (const char* kind : {".depth.pfm", ".normal.pfm", ".confidence.pfm"}) {
      const cv::Mat values = ReadPfm(stem + kind);
      EXPECT_TRUE(cv::checkRange(values.reshape(1))) << kind;  // finite
    }
    for (const Eigen::Vector3f& p : ReadPly(folder_ / "out/cloud.ply").points) {
      EXPECT_TRUE(p.allFinite());
    }
    EXPECT_TRUE(std::filesystem::exists(stem + ".depth.png"));
    return ReadPfm(stem + ".depth.pfm");
  }

  static double ShareNear(const cv::Mat& depth, double expected) {
    return double(cv::countNonZero(cv::abs(depth - expected) < 0.03 * expected)) /
           double(depth.total());
  }

  std::filesystem::path folder_;
  cv::Mat texture_;
};

TEST_F(BadBundleTool, ThreeFiveSevenAndNineImagesHaveDepth) {
  for (const int num_images : {3, 5, 7, 9}) {
    std::filesystem::remove_all(folder_ / "images");
    std::filesystem::create_directories(folder_ / "images");
    WriteImages(num_images);
    WritePoses(num_images, 0.4);
    // The range is given: what three images tell of it is less than 2 px of motion.
    const cv::Mat depth =
        DepthOfGoodFiles(std::to_string(num_images / 2),
                         "--depth.plane_sweep.min_depth_su 5 --depth.plane_sweep.max_depth_su 20");
    EXPECT_GT(ShareNear(depth, 10), 0.7) << num_images;
  }
}

TEST_F(BadBundleTool, PosesInOnePlaceHaveNoDepth) {
  WritePoses(5, 0);
  ExpectNoDepth("no baseline between the images");
}

TEST_F(BadBundleTool, CamerasThatLookAwayFromEachOtherHaveNoDepth) {
  WritePoses(5, 0.4, "0 1 0 0");  // half a turn
  ExpectNoDepth("the images do not overlap");
}

TEST_F(BadBundleTool, GreyImagesHaveNoDepth) {
  for (int i = 0; i < 5; ++i)
    WriteImage(i, cv::Mat(kBundleHeight, kBundleWidth, CV_8UC3, cv::Scalar(9, 99, 9)));
  ExpectNoDepth("no texture in the middle image");
}

TEST_F(BadBundleTool, SaturatedImagesHaveNoDepth) {
  for (int i = 0; i < 5; ++i) {
    WriteImage(i, cv::Mat(kBundleHeight, kBundleWidth, CV_8UC3, cv::Scalar::all(255)));
  }
  ExpectNoDepth("no texture: the middle image is black or saturated");
}

TEST_F(BadBundleTool, UnrelatedImagesHaveNoDepth) {
  cv::RNG random(8);
  for (int i = 0; i < 5; ++i) {
    cv::Mat image(kBundleHeight, kBundleWidth, CV_8UC3);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(image, image, {}, 2);
    WriteImage(i, image);
  }
  ExpectNoDepth("the images do not match",
                "--depth.plane_sweep.min_depth_su 5 "
                "--depth.plane_sweep.max_depth_su 20");
}

TEST_F(BadBundleTool, HalfSaturatedImagesHaveDepthInTheOtherHalf) {
  for (int i = 0; i < 5; ++i) {
    cv::Mat image = Picture(i);
    image.rowRange(0, kBundleHeight / 2).setTo(cv::Scalar::all(255));
    WriteImage(i, image);
  }
  const cv::Mat depth = DepthOfGoodFiles("2");
  EXPECT_EQ(cv::countNonZero(depth.rowRange(0, kBundleHeight / 2 - 8)), 0);
  EXPECT_GT(ShareNear(depth.rowRange(kBundleHeight / 2 + 8, kBundleHeight), 10), 0.7);
}

TEST_F(BadBundleTool, PlanesThatNoOtherCameraSeesDoNoHarm) {
  // The nearest move by 400 px.
  const cv::Mat depth = DepthOfGoodFiles(
      "2", "--depth.plane_sweep.min_depth_su 0.2 --depth.plane_sweep.max_depth_su 1000");
  EXPECT_GT(ShareNear(depth, 10), 0.7);
}

TEST_F(BadBundleTool, PosesWithNaNOrInfinityAreRefused) {
  for (const std::string bad : {"nan", "inf"}) {
    WriteText(folder_ / "poses.txt", "0 0 0 0 0 0 0 1\n1 " + bad + " 0 0 0 0 0 1\n");
    const CommandResult result = Depth();
    EXPECT_EQ(result.exit_status, 1);
    EXPECT_THAT(result.errors, AllOf(HasSubstr("poses.txt:2"), HasSubstr("a finite number"),
                                     HasSubstr("found " + bad)));
  }
}

TEST_F(BadBundleTool, AFocalLengthOfZeroIsRefused) {
  WriteText(folder_ / "camera.yaml", BundleCameraText(0));
  const CommandResult result = Depth();
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("camera.yaml"), HasSubstr("fx"), HasSubstr("found 0")));
}

TEST_F(BadBundleTool, ImagesSmallerThan64x64AreRefused) {
  const CommandResult result = Depth("--resize 63x64");
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("image is too small for depth"),
                                   HasSubstr("expected at least 64x64, found 63x64")));
}

}  // namespace
}  // namespace mono3d
