// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-simulate as a user runs it, on small pictures.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <sstream>

#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kSmallSequence =
    " --camera.width 96 --camera.height 56 --flight.duration_s 8 --fps 1 --depth-stride 3"
    " --jpeg-quality 90 --scene.kind fields";
constexpr int kNumFrames = 9;

class SimulateTool : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("mono3d_simulate_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  CommandResult Simulate(const std::string& arguments, const std::string& prefix = {}) const {
    return RunCommand(prefix + MONO3D_SIMULATE_TOOL + " " + arguments, folder_);
  }
  std::string Output(const std::string& name) const { return " -o " + (folder_ / name).string(); }

  fs::path folder_;
};

// Content of every file below the folder, by its name in it.
std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      contents[fs::relative(entry.path(), folder)] = ReadText(entry.path());
    }
  }
  return contents;
}

TEST_F(SimulateTool, WritesASequenceThatTheOthersRead) {
  const CommandResult result = Simulate(kSmallSequence + Output("a"));
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const fs::path a = folder_ / "a";
  const CameraModel camera = ReadCameraFile(a / "camera.yaml");
  EXPECT_EQ(camera.width, 96);
  const auto source = OpenFrameSource(a, camera);
  const std::vector<StampedPose> truth = ReadTrajectory(a / "groundtruth.txt");
  ASSERT_EQ(truth.size(), static_cast<std::size_t>(kNumFrames));
  EXPECT_EQ(source->num_frames(), kNumFrames);
  for (const StampedPose& pose : truth) {
    const std::optional<Frame> frame = source->Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->timestamp_s, pose.timestamp_s) << "the very number, however it is printed";
  }
  for (const char* name : {"000000", "000003", "000006"}) {
    const fs::path png = a / "depth" / (std::string(name) + ".png");
    const cv::Mat depth =
        ReadDepthImage(fs::exists(png) ? png : a / "depth" / (std::string(name) + ".pfm"));
    EXPECT_EQ(depth.size(), cv::Size(96, 56));
    EXPECT_GT(cv::countNonZero(depth), 0);
  }
  const auto record = nlohmann::json::parse(std::ifstream(a / "sequence.json"));
  EXPECT_EQ(record["complete"], true);
  EXPECT_EQ(record["images"], kNumFrames);
  EXPECT_EQ(record["options"]["scene.kind"], "fields");
  EXPECT_LE(record["depth_rounding"].get<double>(), 1.0001e-4);
  const PointCloud cloud = ReadPly(a / "cloud.ply");
  EXPECT_EQ(cloud.size(), record["cloud"]["points"]);
  EXPECT_EQ(cloud.normals.size(), cloud.size());
  EXPECT_EQ(cloud.colours.size(), cloud.size());
}

TEST_F(SimulateTool, ARunThatGoesOnMakesTheSameBytes) {
  ASSERT_EQ(Simulate(kSmallSequence + Output("a")).exit_status, 0);
  ASSERT_EQ(Simulate(kSmallSequence + Output("b")).exit_status, 0);
  const auto whole = Contents(folder_ / "a");
  EXPECT_TRUE(whole == Contents(folder_ / "b")) << "same seed, same bytes";
  // As if killed: without the end, and with a file half written.
  for (const char* name : {"images/000004.jpg", "images/000006.jpg", "depth/000006.png",
                           "depth/000006.pfm", "cloud.ply"}) {
    fs::remove(folder_ / "b" / name);
  }
  std::string record = ReadText(folder_ / "b/sequence.json");
  auto json = nlohmann::ordered_json::parse(record);
  json["complete"] = false;
  WriteText(folder_ / "b/sequence.json", json.dump(2));
  const CommandResult again = Simulate(kSmallSequence + Output("b"));
  ASSERT_EQ(again.exit_status, 0) << again.errors;
  EXPECT_THAT(again.output, HasSubstr("2 made now"));
  const auto resumed = Contents(folder_ / "b");
  for (const auto& [name, content] : whole) {
    ASSERT_TRUE(resumed.contains(name)) << name;
    // The record of the earlier run goes on; its values are the same.
    EXPECT_TRUE(resumed.at(name) == content) << name;
  }
  EXPECT_THAT(Simulate(kSmallSequence + Output("b")).output, HasSubstr("0 made now"));
}

TEST_F(SimulateTool, RefusesToMixTwoSequences) {
  ASSERT_EQ(Simulate(kSmallSequence + " --max-frames 2" + Output("a")).exit_status, 0);
  const CommandResult other = Simulate(kSmallSequence + " --max-frames 2 --seed 2" + Output("a"));
  EXPECT_EQ(other.exit_status, 1);
  EXPECT_THAT(other.errors, HasSubstr("another sequence was begun in this folder"));
  fs::create_directories(folder_ / "photos/images");
  WriteText(folder_ / "photos/images/holiday.jpg", "x");
  EXPECT_THAT(Simulate(kSmallSequence + Output("photos")).errors,
              HasSubstr("images of another origin"));
}

TEST_F(SimulateTool, AnotherSeedIsAnotherSequence) {
  ASSERT_EQ(Simulate(kSmallSequence + " --max-frames 1" + Output("a")).exit_status, 0);
  ASSERT_EQ(Simulate(kSmallSequence + " --max-frames 1 --seed 2" + Output("b")).exit_status, 0);
  EXPECT_NE(ReadText(folder_ / "a/images/000000.jpg"), ReadText(folder_ / "b/images/000000.jpg"));
  EXPECT_NE(ReadText(folder_ / "a/gps.txt"), ReadText(folder_ / "b/gps.txt"));
}

TEST_F(SimulateTool, AFullDiskIsNamedAndLeavesNoHalfWrittenFile) {
  // Files of at most 16 KiB (a depth image has 21), and no signal when one would grow larger.
  const CommandResult result =
      Simulate(kSmallSequence + " --depth-form pfm --max-frames 1" + Output("a"),
               "trap '' XFSZ; ulimit -f 32; ");
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.errors, HasSubstr("cannot write the file"));
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1);
  for (const auto& [name, content] : Contents(folder_ / "a")) {
    EXPECT_EQ(name.find(".partial"), std::string::npos) << name;
  }
}

TEST_F(SimulateTool, BadArgumentsAreOneLine) {
  const std::array<std::pair<const char*, const char*>, 8> cases = {
      {{"", "--output"},
       {"-o x --suite paper52", "--suite"},
       {"-o x --suite quick --only nothing", "--only"},
       {"-o x --suite quick --scene.kind town", "--scene.kind"},
       {"-o x --device 0", "--device"},  // it computes on none
       {"-o x --scene.kind moon", "moon"},
       {"-o x --fps 0", "--fps"},
       {"-o x --jpeg-quality 101", "--jpeg-quality"}}};
  for (const auto& [arguments, expected] : cases) {
    const CommandResult result = Simulate(arguments);
    EXPECT_EQ(result.exit_status, 2) << arguments;
    EXPECT_THAT(result.errors, HasSubstr(expected)) << arguments;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
}

TEST_F(SimulateTool, PlansASuiteWithoutFilmingIt) {
  const CommandResult result = Simulate("--suite paper51 --dry-run --only '*orbit*'");
  EXPECT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("the paper, Table 1"));
  EXPECT_THAT(result.output, HasSubstr("71.10"));
}

TEST_F(SimulateTool, FilmsCamerasWithAndWithoutTheirCalibration) {
  const CommandResult result = Simulate(
      "--suite cameras --only '*_02_*' --seed 3 --camera.width 96 --camera.height 54"
      " --max-frames 4 --depth-stride 2" +
      Output("suite"));
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const fs::path folder = fs::directory_iterator(folder_ / "suite")->path();
  const CameraModel camera = ReadCameraFile(folder / "camera.yaml");
  EXPECT_EQ(camera.width, 96);
  EXPECT_GE(camera.fx / camera.width, 0.55);
  EXPECT_LE(camera.fx / camera.width, 1.3);
  EXPECT_TRUE(camera.HasDistortion());
  const auto record = nlohmann::json::parse(std::ifstream(folder / "sequence.json"));
  EXPECT_DOUBLE_EQ(record["camera"]["cx"].get<double>(), camera.cx);
  const auto files = Contents(folder);
  int num_images = 0;
  for (const auto& [name, content] : Contents(folder / "uncalibrated")) {
    EXPECT_TRUE(files.at(name) == content) << name;
    EXPECT_EQ(name.find("camera"), std::string::npos) << name;
    num_images += name.starts_with("images/") ? 1 : 0;
  }
  EXPECT_EQ(num_images, 4);
}

}  // namespace
}  // namespace mono3d
