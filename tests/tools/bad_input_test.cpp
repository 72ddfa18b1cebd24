// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Bad input to the tools: the exit status, and one line on stderr that helps.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
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
    // Not all the same.
    image(cv::Rect(0, 0, 16, 16)) = cv::Scalar::all(20 * (name[0] - '0'));
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
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) {
    WriteText(images() / name, "I am no image.\n");
  }
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

TEST_F(BadInput, AnImageOfAnotherSizeIsSkippedAndCounted) {
  WriteImage("3.png", 32);
  const CommandResult result = Reconstruct();
  EXPECT_THAT(result.errors, AllOf(HasSubstr("skipped: 3.png"), HasSubstr("found 32x64")));
  EXPECT_THAT(ReadText(folder_ / "out" / "run.json"), HasSubstr("\"images_skipped\": 1"));
}

TEST_F(BadInput, MessagesDoNothingToATerminal) {
  WriteText(camera(), "image_width: \"\\e[31m" + std::string(5000, 'x') + "\"\n");
  const CommandResult result = Reconstruct();
  ExpectError(result, kFailure, "\\x1b[31mxxx", "bytes)");
  EXPECT_EQ(result.errors.find('\x1b'), std::string::npos);
  EXPECT_LT(result.errors.size(), 1000U);
}

TEST_F(BadInput, PipesAndDevicesAreRefusedAtOnce) {
  const std::string pipe = (folder_ / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& file : {pipe, std::string("/dev/zero")}) {
    ExpectError(
        RunCommand(std::string("timeout 20 ") + MONO3D_RECONSTRUCT_TOOL + " " + images().string() +
                       " --camera " + file + " -o " + (folder_ / "out").string(),
                   folder_),
        kFailure, file, "not a regular one");
    ExpectError(RunCommand(std::string("timeout 20 ") + MONO3D_RECONSTRUCT_TOOL + " " + file +
                               " -o " + (folder_ / "out").string(),
                           folder_),
                kFailure, file, "neither a file nor a folder");
  }
}

// By what its head says, also where images are only looked at.
TEST_F(BadInput, AnImageThatSaysItIsHugeIsNotDecoded) {
  for (const char* name : {"0.png", "1.png"}) {
    std::string bytes = ReadText(images() / name);
    bytes.replace(16, 8, std::string("\0\0\x7D\0\0\0\x7D\0", 8));  // 32000x32000
    WriteText(images() / name, bytes);
  }
  // A decoded one would not fit.
  const CommandResult result = RunCommand(
      "ulimit -v 3000000; " + std::string(MONO3D_RECONSTRUCT_TOOL) + " " + images().string() +
          " --camera " + camera().string() + " -o " + (folder_ / "out").string(),
      folder_);
  EXPECT_EQ(result.errors.find("memory"), std::string::npos) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("the image is too large"));
}

TEST_F(BadInput, TooLittleMemoryIsSaid) {
  for (const char* limit_kb : {"700000", "1000000"}) {
    const CommandResult result =
        RunCommand("ulimit -v " + std::string(limit_kb) + "; " + MONO3D_DEPTH_TOOL + " " +
                       images().string() + " --camera " + camera().string() + " --poses " +
                       (folder_ / "poses.txt").string() + " -o " + (folder_ / "out").string(),
                   folder_);
    ExpectError(result, kFailure, "not enough memory", "");
  }
}

TEST_F(BadInput, AFileSizeLimitIsAnErrorOfTheFile) {
  // Files of at most 4 KiB: run.json is larger.
  const CommandResult result =
      RunCommand("ulimit -f 8; " + std::string(MONO3D_RECONSTRUCT_TOOL) + " " + images().string() +
                     " --camera " + camera().string() + " -o " + (folder_ / "out").string(),
                 folder_);
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, HasSubstr("run.json: cannot write the file: File too large"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out" / "run.json.partial"));
}

TEST_F(BadInput, AClosedStderrEndsNoRun) {
  const CommandResult result =
      RunCommand("( " + std::string(MONO3D_RECONSTRUCT_TOOL) + " --no-such-option; echo $? >" +
                     (folder_ / "status").string() + " ) 2>&1 | true",
                 folder_);
  EXPECT_EQ(ReadText(folder_ / "status"), "2\n");
}

TEST_F(BadInput, ARecordOfManyNestedArraysIsRefused) {
  std::filesystem::create_directories(folder_ / "run");
  WriteText(folder_ / "run" / "run.json",
            "{\"x\":" + std::string(60'000, '[') + std::string(60'000, ']') + "}");
  WriteText(folder_ / "run" / "trajectory.txt", ReadText(folder_ / "poses.txt"));
  WriteText(folder_ / "groundtruth.txt", ReadText(folder_ / "poses.txt"));
  const CommandResult result = RunCommand(std::string(MONO3D_EVALUATE_TOOL) + " run " +
                                              (folder_ / "run").string() + " " + folder_.string(),
                                          folder_);
  EXPECT_THAT(result.exit_status, testing::AnyOf(0, kFailure)) << result.errors;
}

TEST_F(BadInput, TheDepthToolTakesNamesThatAreNotUtf8) {
  std::string names;
  for (int i = 0; i < 5; ++i) {
    const std::string name = "\xE4" + std::to_string(i) + ".png";
    std::filesystem::rename(images() / (std::to_string(i) + ".png"), images() / name);
  }
  const CommandResult result = Depth(images().string());
  EXPECT_EQ(result.errors.find("invalid UTF-8"), std::string::npos) << result.errors;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "bundle.json"));
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
  EXPECT_THAT(ReadText(folder_ / "out/report.html"), testing::HasSubstr("There is no model"));
}

TEST_F(BadInput, APresetChangesDefaultsAndNotWhatIsGiven) {
  const auto options_of = [&](const std::string& extra) {
    std::filesystem::remove_all(folder_ / "out");
    EXPECT_EQ(Reconstruct(extra).exit_status, kFailure);  // no model
    return nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"))["options"];
  };
  const auto fast = options_of("--fast --keyframes.num_images 3");
  EXPECT_EQ(fast["depth.pyramid.level"], 1);
  EXPECT_EQ(fast["keyframes.num_images"], 3);
  EXPECT_EQ(options_of("--depth.pyramid.level 0 --fast")["depth.pyramid.level"], 0);
  EXPECT_EQ(options_of("--best")["keyframes.num_images"], 9);
}

}  // namespace
}  // namespace mono3d
