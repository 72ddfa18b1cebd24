// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Images that do not show the scene everywhere.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/io/frame_source.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const cv::Point kMarkCorner(30, 60);
constexpr const char* kMark = "ALT 62 RC 98";

void DrawMark(cv::Mat& image) {
  cv::putText(image, kMark, kMarkCorner, cv::FONT_HERSHEY_SIMPLEX, 1.2, cv::Scalar::all(255), 3);
}

class SceneMaskOfRun : public TemporaryFolderTest {
 protected:
  // 36 images of the example, with text in them.
  SceneMaskOfRun() {
    const std::filesystem::path flight = MONO3D_EXAMPLE;
    std::filesystem::create_directories(folder_ / "marked/images");
    std::filesystem::copy(flight / "camera.yaml", folder_ / "marked");
    int i = 0;
    for (const std::string& name : ListImages(flight)) {
      cv::Mat image = cv::imread(name);
      DrawMark(image);
      cv::imwrite(folder_ / "marked/images" / std::filesystem::path(name).filename(), image);
      if (++i == 36) break;
    }
  }

  CommandResult Reconstruct(const std::string& arguments) const {
    return RunCommand("cd " + folder_.string() + " && " + MONO3D_RECONSTRUCT_TOOL +
                          " marked --camera marked/camera.yaml --camera-fixed -o out"
                          " --max-side 384 --depth-files none " +
                          arguments,
                      folder_);
  }
};

TEST_F(SceneMaskOfRun, IsFoundWhereTextWasDrawn) {
  const CommandResult run = Reconstruct("");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  EXPECT_THAT(run.output, HasSubstr("% of the images stays at its place, such as text"));
  const cv::Mat mask = cv::imread(folder_ / "out/mask.png", cv::IMREAD_GRAYSCALE);
  ASSERT_EQ(mask.size(), cv::Size(768, 448));
  cv::Mat letters(mask.size(), CV_8UC1, cv::Scalar(0));
  DrawMark(letters);
  EXPECT_LT(cv::countNonZero(mask & letters), 0.05 * cv::countNonZero(letters));
  EXPECT_GT(cv::countNonZero(mask), 0.9 * static_cast<double>(mask.total()));
  // As it is told; what an earlier run left there goes.
  const CommandResult told = Reconstruct("--mask none");
  ASSERT_EQ(told.exit_status, 0) << told.errors;
  EXPECT_THAT(told.output, Not(HasSubstr("stays at its place")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/mask.png"));
}

TEST_F(SceneMaskOfRun, IsFoundWhereACameraIsLearned) {
  const std::string command = "cd " + folder_.string() + " && " + MONO3D_CALIBRATE_TOOL +
                              " marked -o learned.yaml --resize 384x224 --calibration.max_rounds 1";
  const CommandResult found = RunCommand(command, folder_);
  ASSERT_EQ(found.exit_status, 0) << found.errors;
  EXPECT_THAT(found.output, HasSubstr("% of the images stays at its place, such as text"));
  const CommandResult told = RunCommand(command + " --mask none", folder_);
  ASSERT_EQ(told.exit_status, 0) << told.errors;
  EXPECT_THAT(told.output, Not(HasSubstr("stays at its place")));
}

TEST_F(SceneMaskOfRun, IsReadFromAFileOfTheirShape) {
  cv::Mat mask(224, 384, CV_8UC1, cv::Scalar(255));
  mask.rowRange(112, 224).setTo(0);
  cv::imwrite(folder_ / "half.png", mask);
  cv::imwrite(folder_ / "square.png", cv::Mat(300, 300, CV_8UC1, cv::Scalar(255)));
  const CommandResult refused = Reconstruct("--mask square.png");
  EXPECT_NE(refused.exit_status, 0);
  EXPECT_THAT(refused.errors, AllOf(HasSubstr("mask has another shape than the images"),
                                    HasSubstr("square.png"), HasSubstr("768x448")));
  EXPECT_NE(Reconstruct("--mask absent.png").exit_status, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  const CommandResult run = Reconstruct("--mask half.png");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  const cv::Mat used = cv::imread(folder_ / "out/mask.png", cv::IMREAD_GRAYSCALE);
  EXPECT_EQ(cv::norm(used, mask, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace mono3d
