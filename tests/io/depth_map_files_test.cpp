// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/depth_map_files.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/pfm_file.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

using DepthMapFiles = TemporaryFolderTest;

CameraModel DepthCamera() { return {6, 4, 5, 5, 2.5, 1.5, {}}; }

TEST_F(DepthMapFiles, AreThoseOfTheImagesThatTheMapHas) {
  DepthMap map;
  map.camera = DepthCamera();
  map.depth = cv::Mat(4, 6, CV_32FC1, cv::Scalar(2));
  WriteDepthMap(folder_, "000042", map);
  EXPECT_EQ(cv::countNonZero(ReadPfm(folder_ / "000042.depth.pfm") != map.depth), 0);
  EXPECT_EQ(cv::imread(folder_ / "000042.depth.png").size(), map.depth.size());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "000042.normal.pfm"));

  map.normal = cv::Mat(4, 6, CV_32FC3, cv::Scalar(0, 0.6, -0.8));
  map.confidence = cv::Mat(4, 6, CV_32FC1, cv::Scalar(0.5));
  WriteDepthMap(folder_, "000042", map);
  EXPECT_EQ(ReadPfm(folder_ / "000042.normal.pfm").at<cv::Vec3f>(0, 0), cv::Vec3f(0, 0.6F, -0.8F));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "000042.normal.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "000042.confidence.pfm"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "000042.confidence.png"));
}

TEST_F(DepthMapFiles, HavePreviewsOfEveryFewPixels) {
  DepthMap map;
  map.camera = DepthCamera();
  map.depth = cv::Mat(4, 6, CV_32FC1, cv::Scalar(2));
  map.normal = cv::Mat(4, 6, CV_32FC3, cv::Scalar(0, 0.6, -0.8));
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) {
      if (x % 4 == 0 && y % 4 == 0) map.normal.at<cv::Vec3f>(y, x) = {0, 0, -1};
    }
  }
  WriteDepthMap(folder_, "1", map, {.preview_step_px = 4});
  EXPECT_EQ(cv::imread(folder_ / "1.depth.png").size(), cv::Size(2, 1));
  const cv::Mat preview = cv::imread(folder_ / "1.normal.png");
  ASSERT_EQ(preview.size(), cv::Size(2, 1));
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 1), cv::Vec3b(255, 128, 128));
  EXPECT_EQ(ReadPfm(folder_ / "1.depth.pfm").size(), map.depth.size()) << "the map stays whole";
}

TEST_F(DepthMapFiles, OfEachFormAreReadAsTheyWere) {
  DepthMap map;
  map.camera = DepthCamera();
  map.depth = cv::Mat(4, 6, CV_32FC1, cv::Scalar(1.23456789));
  map.depth.at<float>(0, 0) = 0;
  map.depth.at<float>(0, 1) = 1000;  // beyond 16 bits
  map.normal = cv::Mat(4, 6, CV_32FC3, cv::Scalar(0, 0.6, -0.8));
  map.normal.at<cv::Vec3f>(0, 0) = {0, 0, 0};
  map.confidence = cv::Mat(4, 6, CV_32FC1, cv::Scalar(0.3));
  map.inferred = cv::Mat(4, 6, CV_8UC1, cv::Scalar(255));
  WriteText("scale.txt", "2000\n");
  const auto read = [&](DepthFileForm form, std::size_t ending, double step) {
    WriteDepthMap(folder_, "7", map, {form, false});
    const auto path = [&](const char* kind) {
      return (folder_ / "7").string() + DepthFileEndings(kind)[ending];
    };
    const cv::Mat depth = ReadDepthImage(path("depth"));
    EXPECT_EQ(depth.at<float>(0, 0), 0);
    EXPECT_EQ(depth.at<float>(0, 1), form == DepthFileForm::kPng16 ? 0 : 1000);
    EXPECT_NEAR(depth.at<float>(2, 3), 1.23456789F, step);
    EXPECT_NEAR(ReadConfidence(path("confidence")).at<float>(1, 1), 0.3, 2e-4);
    const cv::Mat normal = ReadNormals(path("normal"));
    EXPECT_EQ(normal.at<cv::Vec3f>(0, 0), cv::Vec3f(0, 0, 0));
    EXPECT_LT(cv::norm(normal.at<cv::Vec3f>(1, 1), cv::Vec3f(0, 0.6F, -0.8F)), 1e-3);
  };
  read(DepthFileForm::kPfm, 0, 0);
  read(DepthFileForm::kExr, 1, 0);
  read(DepthFileForm::kPng16, 2, 0.5 / kDepthPngScale);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "7.inferred.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "7.depth.png")) << "no preview was asked for";
  WriteDepthMap(folder_, "8", map, {DepthFileForm::kNone, true});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "8.inferred.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "8.depth.png"));
}

TEST_F(DepthMapFiles, RefuseImagesOfAnotherType) {
  DepthMap map;
  map.camera = DepthCamera();
  map.depth = cv::Mat(4, 6, CV_32FC3, cv::Scalar(2));
  EXPECT_THAT([&] { WriteDepthMap(folder_, "a", map); },
              ThrowsMessage<Error>(HasSubstr("depth map: wrong size or type of depth (expected 6x4 "
                                             "CV_32FC1, found 6x4 CV_32FC3)")));
}

TEST(DepthPreview, IsRedNearBlueFarAndBlackWithoutEstimate) {
  cv::Mat depth(1, 100, CV_32FC1);
  for (int x = 0; x < 100; ++x) depth.at<float>(0, x) = 1 + static_cast<float>(x);
  depth.at<float>(0, 50) = 0;
  const cv::Mat preview = DepthPreview(depth);
  const auto near = preview.at<cv::Vec3b>(0, 0);
  const auto far = preview.at<cv::Vec3b>(0, 99);
  EXPECT_GT(near[2], 2 * near[0]);
  EXPECT_GT(far[0], far[2]);
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 50), cv::Vec3b(0, 0, 0));
}

TEST(DepthPreview, OfAConstantOrEmptyMapIsDefined) {
  const cv::Mat constant = DepthPreview(cv::Mat(3, 3, CV_32FC1, cv::Scalar(5)));
  EXPECT_NE(constant.at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 0));
  const cv::Mat nothing = DepthPreview(cv::Mat(3, 3, CV_32FC1, cv::Scalar(0)));
  EXPECT_EQ(nothing.at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 0));
}

TEST(NormalPreview, ShowsRightUpAndTowardsTheCameraAsRedGreenAndBlue) {
  const cv::Mat normal = cv::Mat_<cv::Vec3f>(
      {1, 4}, {cv::Vec3f(1, 0, 0), cv::Vec3f(0, -1, 0), cv::Vec3f(0, 0, -1), cv::Vec3f(0, 0, 0)});
  const cv::Mat preview = NormalPreview(normal);
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 0)[2], 255);
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 1)[1], 255);
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 2)[0], 255);
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 3), cv::Vec3b(0, 0, 0));
}

TEST(ConfidencePreview, IsGrey) {
  const cv::Mat preview = ConfidencePreview(cv::Mat_<float>({1, 2}, {0.0F, 1.0F}));
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(preview.at<cv::Vec3b>(0, 1), cv::Vec3b(255, 255, 255));
}

}  // namespace
}  // namespace mono3d
