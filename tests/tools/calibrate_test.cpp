// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-calibrate on the shipped sequence, on boards and on what shows neither.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "calibration/board_scene.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/io/camera_file.h"
#include "reference/random.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

const std::filesystem::path kVillage = MONO3D_EXAMPLE;

class CalibrateTool : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_calibrate_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "images");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  CommandResult Calibrate(const std::string& arguments) const {
    return RunCommand(
        std::string(MONO3D_CALIBRATE_TOOL) + " " + arguments + " -o " + output().string(), folder_);
  }

  std::filesystem::path images() const { return folder_ / "images"; }
  std::filesystem::path output() const { return folder_ / "camera.yaml"; }

  void WriteImages(const std::vector<cv::Mat>& images_of_test) const {
    char name[32];
    for (std::size_t i = 0; i < images_of_test.size(); ++i) {
      std::snprintf(name, sizeof name, "%03zu.png", i);
      cv::imwrite((images() / name).string(), images_of_test[i]);
    }
  }

  std::filesystem::path folder_;
};

TEST_F(CalibrateTool, LearnsTheLensOfAFlightAndReports) {
  const std::filesystem::path report = folder_ / "report";
  const CommandResult result = Calibrate(kVillage.string() + " --report " + report.string());
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const CameraModel truth = ReadCameraFile(kVillage / "camera.yaml");
  const CameraModel found = ReadCameraFile(output());
  EXPECT_NEAR(found.fx, truth.fx, 0.01 * truth.fx);
  EXPECT_THAT(result.output, HasSubstr("focal length "));
  EXPECT_THAT(result.output, HasSubstr(" from default)"));
  EXPECT_THAT(result.output, HasSubstr("principal point "));
  EXPECT_THAT(result.output, HasSubstr("distortion k1 "));
  EXPECT_THAT(result.output, HasSubstr("distortion p1, p2 "));
  const auto json = nlohmann::json::parse(std::ifstream(report / "calibration.json"));
  EXPECT_EQ(json["prior"]["source"], "default");
  EXPECT_EQ(json["parameters"]["fx"]["value"], found.fx);
  EXPECT_EQ(json["parameters"]["fx"]["determined"], true);
  EXPECT_GT(json["parameters"]["fx"]["sigma"], 0);
  EXPECT_EQ(json["parameters"]["readout_s"]["value"], found.shutter.readout_s);
  EXPECT_GT(json["observations"], 500);
  EXPECT_GE(json["rms_px"], json["sigma_px"].get<double>());
  for (const char* name : {"residuals.png", "residuals_by_radius.png"}) {
    EXPECT_FALSE(cv::imread((report / name).string()).empty()) << name;
  }
}

TEST_F(CalibrateTool, KeepsACalibrationThatTheImagesAgreeWith) {
  const std::filesystem::path camera = kVillage / "camera.yaml";
  const CommandResult result = Calibrate(kVillage.string() + " --camera " + camera.string());
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("the images agree with the calibration\n"));
  EXPECT_EQ(ReadCameraFile(output()), ReadCameraFile(camera));
}

TEST_F(CalibrateTool, LearnsFromAChessboard) {
  WriteImages(BoardScene({}, BoardCamera()).RenderMany(20, 45, SeedFromTestName()));
  const CommandResult result = Calibrate(images().string() + " --board 9x6");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const CameraModel found = ReadCameraFile(output());
  EXPECT_NEAR(found.fx, BoardCamera().fx, 0.003 * BoardCamera().fx);
  EXPECT_LT(LargestDifference_px(found, BoardCamera()), 1);
}

TEST_F(CalibrateTool, LearnsFromACharucoBoardInAnotherSize) {
  const CalibrationBoard board{BoardKind::kCharuco, 8, 6, "DICT_5X5_100", 0.7};
  WriteImages(BoardScene(board, BoardCamera()).RenderMany(20, 45, SeedFromTestName()));
  const CommandResult result =
      Calibrate(images().string() + " --charuco 8x6 --marker-share 0.7 --resize 512x384");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const CameraModel found = ReadCameraFile(output());
  EXPECT_EQ(found.width, 640) << "as the images are";
  EXPECT_NEAR(found.fx, BoardCamera().fx, 0.005 * BoardCamera().fx);
}

TEST_F(CalibrateTool, SaysInOneLineWhyNothingIsLearned) {
  std::vector<cv::Mat> empty_images;
  for (const int grey : {60, 80, 100, 120}) {
    empty_images.emplace_back(120, 160, CV_8UC3, cv::Scalar::all(grey));
  }
  WriteImages(empty_images);
  for (const std::string board : {"", " --board 9x6", " --charuco 7x5"}) {
    const CommandResult result =
        Calibrate(images().string() + board + " --report " + (folder_ / "report").string());
    EXPECT_EQ(result.exit_status, kFailure);
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("no camera can be learned: "));
    EXPECT_EQ(result.output, "");
    EXPECT_FALSE(std::filesystem::exists(output()));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "report"));
  }
}

TEST_F(CalibrateTool, RefusesWrongBoards) {
  const std::string input = images().string();
  for (const std::string arguments :
       {" --board 9", " --board 9x6x2", " --board 2x6", " --charuco 7x5 --dictionary DICT_9X9",
        " --charuco 7x5 --board 9x6", " --dictionary DICT_5X5_50"}) {
    const CommandResult result = Calibrate(input + arguments);
    EXPECT_EQ(result.exit_status, kWrongUsage) << arguments << ": " << result.errors;
  }
}

}  // namespace
}  // namespace mono3d
