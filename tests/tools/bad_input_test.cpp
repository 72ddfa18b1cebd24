// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Bad input to the tools: the exit status, and one line on stderr that helps.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tools/command.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string CameraText(const std::string& fx = "60", int width = 64) {
  return "%YAML:1.0\n---\nimage_width: " + std::to_string(width) +
         "\nimage_height: 64\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
         "   data: [ " +
         fx +
         ", 0., 31.5, 0., 60., 31.5, 0., 0., 1. ]\n"
         "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
         "   data: [ 0., 0., 0., 0., 0. ]\n";
}

// A folder of five images of noise, their camera and their poses; each test spoils one thing.
class BadInput : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_bad_input_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(images());
    std::string poses;
    for (int i = 0; i < 5; ++i) {
      WriteImage(std::to_string(i) + ".png", 64);
      poses += std::to_string(i) + " " + std::to_string(0.1 * i) + " 0 0 0 0 0 1\n";
    }
    WriteText(camera(), CameraText());
    WriteText(folder_ / "poses.txt", poses);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path images() const { return folder_ / "images"; }
  std::filesystem::path camera() const { return folder_ / "camera.yaml"; }

  void WriteImage(const std::string& name, int width) const {
    cv::Mat image(64, width, CV_8UC3);
    cv::RNG random(7);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    cv::imwrite((images() / name).string(), image);
  }

  CommandResult Reconstruct(const std::string& extra = {}) const {
    return RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + images().string() +
                          " --camera " + camera().string() + " -o " + (folder_ / "out").string() +
                          " " + extra,
                      folder_);
  }
  CommandResult Depth(const std::string& input, const std::string& prefix = {}) const {
    return RunCommand(prefix + MONO3D_DEPTH_TOOL + " " + input + " --camera " + camera().string() +
                          " --poses " + (folder_ / "poses.txt").string() + " -o " +
                          (folder_ / "out").string(),
                      folder_);
  }

  // The status, and one line that begins with the tool's name and holds both texts.
  static void ExpectError(const CommandResult& result, int status, const std::string& first,
                          const std::string& second) {
    EXPECT_EQ(result.exit_status, status) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_THAT(result.errors, AllOf(HasSubstr("mono3d-"), HasSubstr(": error: "), HasSubstr(first),
                                     HasSubstr(second)));
  }

  std::filesystem::path folder_;
};

TEST_F(BadInput, UnknownOptionIsWrongUsage) {
  ExpectError(Reconstruct("--no-such-option 3"), kWrongUsage, "--no-such-option", "--help");
}

TEST_F(BadInput, OptionOutOfRangeIsNamed) {
  ExpectError(Reconstruct("--keyframes.best_angle_deg 200"), kWrongUsage,
              "--keyframes.best_angle_deg", "found 200");
}

TEST_F(BadInput, LensIsOneOfThree) {
  ExpectError(Reconstruct("--lens wide"), kWrongUsage, "--lens", "wide");
}

TEST_F(BadInput, CalibrationOfAnotherLensThanIsAskedFor) {
  ExpectError(Reconstruct("--lens fisheye"), kWrongUsage, camera().string(),
              "the calibration is of another lens");
}

TEST_F(BadInput, EmptyFolder) {
  std::filesystem::remove_all(images());
  std::filesystem::create_directories(images());
  ExpectError(Reconstruct(), kFailure, images().string(), "image");
}

TEST_F(BadInput, MissingInput) {
  std::filesystem::remove_all(images());
  ExpectError(Reconstruct(), kFailure, images().string(), "no such file or folder");
}

TEST_F(BadInput, MissingCameraFile) {
  std::filesystem::remove(camera());
  ExpectError(Reconstruct(), kFailure, camera().string(), "");
}

TEST_F(BadInput, CameraFileWithNaN) {
  WriteText(camera(), CameraText(".Nan"));
  ExpectError(Reconstruct(), kFailure, camera().string(), "found");
}

TEST_F(BadInput, CameraFileOfAnotherSize) {
  WriteText(camera(), CameraText("60", 80));
  ExpectError(Depth(images().string()), kFailure, "expected 80x64", "found 64x64");
}

TEST_F(BadInput, TextFileNamedJpg) {
  std::filesystem::remove_all(images());
  std::filesystem::create_directories(images());
  WriteText(images() / "a.jpg", "I am no image.\n");
  const CommandResult result = Reconstruct();
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, HasSubstr("not one image can be read"));
}

TEST_F(BadInput, TextFileNamedMp4) {
  std::filesystem::remove_all(images());
  WriteText(images(), "I am no video.\n");
  ExpectError(Reconstruct(), kFailure, "cannot open the video", "FFmpeg");
}

TEST_F(BadInput, UnreadableImageForTheDepthTool) {
  WriteText(images() / "3.png", "I am no image.\n");
  ExpectError(Depth(images().string()), kFailure, "3.png: not an image", "");
}

TEST_F(BadInput, UnknownNameInAConfigFile) {
  WriteText(folder_ / "options.txt", "[keyframes]\nno_such_option = 3\n");
  ExpectError(Reconstruct("--config " + (folder_ / "options.txt").string()), kWrongUsage,
              "keyframes.no_such_option", "");
}

TEST_F(BadInput, MissingConfigFile) {
  ExpectError(Reconstruct("--config none.txt"), kWrongUsage, "none.txt", "");
}

TEST_F(BadInput, ImagesOfTwoSizesForTheDepthTool) {
  WriteImage("3.png", 32);
  ExpectError(Depth(images().string()), kFailure, "3.png", "found 32x64");
}

TEST_F(BadInput, ImagesOfTwoSizesKeepWhatIsThereSoFar) {
  WriteImage("3.png", 32);
  const CommandResult result = Reconstruct();
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("3.png"), HasSubstr("found 32x64")));
  EXPECT_THAT(ReadText(folder_ / "out" / "run.json"), HasSubstr("\"end\": \"failed\""));
}

TEST_F(BadInput, FourImagesForTheDepthTool) {
  std::filesystem::remove(images() / "4.png");
  ExpectError(Depth(images().string()), kWrongUsage, "expected 3, 5, 7 or 9", "found 4");
}

TEST_F(BadInput, FourNamedImagesForTheDepthTool) {
  std::string names;
  for (int i = 0; i < 4; ++i) names += (images() / (std::to_string(i) + ".png ")).string();
  ExpectError(Depth(names), kWrongUsage, "expected 3, 5, 7 or 9", "found 4");
}

TEST_F(BadInput, WrongNumberOfPoses) {
  WriteText(folder_ / "poses.txt", "0 0 0 0 0 0 0 1\n");
  ExpectError(Depth(images().string()), kFailure, "poses.txt", "found 1");
}

TEST_F(BadInput, PoseWithANonUnitQuaternion) {
  WriteText(folder_ / "poses.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 2\n");
  ExpectError(Depth(images().string()), kFailure, "poses.txt:2", "quaternion");
}

TEST_F(BadInput, PosesWithoutBaseline) {
  std::string poses;
  for (int i = 0; i < 5; ++i) poses += std::to_string(i) + " 0 0 0 0 0 0 1\n";
  WriteText(folder_ / "poses.txt", poses);
  ExpectError(Depth(images().string()), kFailure, "no depth", "baseline");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out" / "2.depth.pfm"));
}

TEST_F(BadInput, OutputFolderBelowAFile) {
  WriteText(folder_ / "out", "I am no folder.\n");
  ExpectError(Reconstruct(), kFailure, (folder_ / "out").string(), "");
}

TEST_F(BadInput, NoVulkanDeviceNamesThePackage) {
  ExpectError(Depth(images().string(), "VK_DRIVER_FILES=/nonexistent "), kFailure,
              "mesa-vulkan-drivers", "");
}

TEST_F(BadInput, UnknownDeviceIsWrongUsage) {
  ExpectError(Reconstruct("--device 'no such device'"), kWrongUsage, "no such device", "");
}

TEST_F(BadInput, StillImagesGiveAReasonWhyThereIsNoModel) {
  const CommandResult result = Reconstruct();
  ExpectError(result, kFailure, "no model", "reason");
}

}  // namespace
}  // namespace mono3d
