// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-evaluate on small files whose errors are known.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>

#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/pfm_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"
#include "tools/small_run.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

constexpr double kFileRounding = 1e-5;  // files hold floats

class Evaluate : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_evaluate_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    paths_ = WriteSmallRun(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  CommandResult Run(const std::string& arguments) const {
    return RunCommand("cd " + folder_.string() + " && " + MONO3D_EVALUATE_TOOL + " " + arguments,
                      folder_);
  }
  Json ReadJson(const std::string& name) const {
    return Json::parse(std::ifstream(folder_ / name));
  }
  // The status, and one line that begins with the tool's name and holds both texts.
  void ExpectError(const std::string& arguments, int status, const std::string& first,
                   const std::string& second = {}) const {
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_status, status) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_THAT(result.errors,
                AllOf(HasSubstr("mono3d-evaluate: error: "), HasSubstr(first), HasSubstr(second)));
  }

  std::filesystem::path folder_;
  SmallRun paths_;
};

TEST_F(Evaluate, TrajectoryErrorsAreThoseWorkedOutByHand) {
  std::string estimate;
  std::string truth;
  for (int i = 0; i < 5; ++i) {
    truth += std::to_string(i) + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
    // Off by i metres across the way: 0, 1, 2, 3, 4.
    estimate +=
        std::to_string(i) + " " + std::to_string(i) + " " + std::to_string(i) + " 0 0 0 0 1\n";
  }
  WriteText(folder_ / "estimate.txt", estimate);
  WriteText(folder_ / "truth.txt", truth);
  const CommandResult result =
      Run("trajectory estimate.txt truth.txt --align none --mean-depth 100 --json out.json");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("2.449 (2.449 %)"));
  const Json position = ReadJson("out.json")["trajectory"]["position_m"];
  EXPECT_EQ(position["count"], 5);
  EXPECT_NEAR(position["rmse"], std::sqrt(30.0 / 5), kFileRounding);
  EXPECT_NEAR(position["mean"], 2, kFileRounding);
  EXPECT_NEAR(position["median"], 2, kFileRounding);
  EXPECT_NEAR(position["sigma"], std::sqrt(2), kFileRounding);
  EXPECT_NEAR(position["max"], 4, kFileRounding);
}

TEST_F(Evaluate, TrajectoryOfAnotherScaleFitsAfterSim3Only) {
  const std::string files =
      "trajectory run/trajectory.txt sequence/groundtruth.txt --json out.json";
  ASSERT_EQ(Run(files).exit_status, 0);
  EXPECT_LT(ReadJson("out.json")["trajectory"]["position_m"]["rmse"], kFileRounding);
  EXPECT_NEAR(ReadJson("out.json")["trajectory"]["alignment"]["scale"], 1 / kSmallRunScale, 1e-6);
  ASSERT_EQ(Run(files + " --align se3").exit_status, 0);
  EXPECT_GT(ReadJson("out.json")["trajectory"]["position_m"]["rmse"], 1);
}

TEST_F(Evaluate, DepthErrorsAreThoseWorkedOutByHand) {
  const CommandResult result =
      Run("depth run/depth sequence/depth --camera sequence/camera.yaml --json out.json");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const Json json = ReadJson("out.json");
  EXPECT_EQ(json["depth"]["maps"], 1) << "frame 2 alone has both";
  const Json mean = json["depth"]["mean"];
  EXPECT_NEAR(mean["density"], 0.9, kFileRounding);
  EXPECT_NEAR(mean["l1_rel"], 0.25 * 0.04, kFileRounding);
  EXPECT_NEAR(mean["l1_abs_m"], 0.25 * 0.4, kFileRounding);
  EXPECT_NEAR(mean["rmse_m"], 0.5 * 0.4, kFileRounding);
  EXPECT_NEAR(mean["delta_1.01"], 0.75, kFileRounding);
  EXPECT_NEAR(mean["delta_1.05"], 1, kFileRounding);
  // The worst tenth holds 0.1 / 0.25 of all error; 0.15 of 0.9 pixels are wrong in what is left.
  EXPECT_NEAR(json["confidence"]["error_removed_by_worst_tenth"], 1 - (0.15 / 0.9) / 0.25,
              kFileRounding);
  EXPECT_NEAR(json["confidence"]["area_to_oracle"], 0, kFileRounding);
  EXPECT_NEAR(json["normals"]["angle_deg"]["median"], 10, 1e-3);
}

TEST_F(Evaluate, DepthFilesOfEachFormGiveTheSameFigures) {
  const std::filesystem::path stem = paths_.run / "depth/000002";
  DepthMap map;
  map.depth = ReadPfm(stem.string() + ".depth.pfm");
  map.confidence = ReadPfm(stem.string() + ".confidence.pfm");
  map.normal = ReadPfm(stem.string() + ".normal.pfm");
  map.camera = ReadCameraFile(paths_.sequence / "camera.yaml");
  const auto figures = [&] {
    const CommandResult result = Run("run run sequence --no-report --json out.json");
    EXPECT_EQ(result.exit_status, 0) << result.errors;
    return ReadJson("out.json");
  };
  const Json of_floats = figures();
  for (const DepthFileForm form : {DepthFileForm::kExr, DepthFileForm::kPng16}) {
    std::filesystem::remove_all(stem.parent_path());
    std::filesystem::create_directories(stem.parent_path());
    WriteText(stem.parent_path() / "scale.txt", "2000\n");
    WriteDepthMap(stem.parent_path(), "000002", map, {form, true});
    const Json json = figures();
    EXPECT_EQ(json["depth"]["maps"], 1);
    EXPECT_NEAR(json["depth"]["mean"]["l1_rel"], of_floats["depth"]["mean"]["l1_rel"], 1e-3);
    EXPECT_NEAR(json["confidence"]["area_to_oracle"], 0, 1e-3);
    EXPECT_NEAR(json["normals"]["angle_deg"]["median"], 10, 0.1);
  }
  std::filesystem::remove_all(stem.parent_path());
  EXPECT_THAT(Run("run run sequence --no-report").output, HasSubstr("--depth-files none"));
}

TEST_F(Evaluate, DepthWithoutScalingIsComparedAsItIs) {
  for (const char* option : {"--no-scaling", "--scaling none"}) {
    const CommandResult result =
        Run(std::string("depth run/depth/000002.depth.pfm sequence/depth/000002.pfm "
                        "--json out.json ") +
            option);
    ASSERT_EQ(result.exit_status, 0) << result.errors;
    // A tenth of the truth, a quarter of the pixels 4 % more than that.
    EXPECT_NEAR(ReadJson("out.json")["depth"]["mean"]["l1_rel"], 0.75 * 0.9 + 0.25 * 0.896,
                kFileRounding);
  }
}

TEST_F(Evaluate, CloudNeedsTheTrajectoriesToBeginWith) {
  const CommandResult result =
      Run("cloud run/model.ply sequence/cloud.ply --est-trajectory run/trajectory.txt "
          "--truth-trajectory sequence/groundtruth.txt --mean-depth 10 --json out.json");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const Json error = ReadJson("out.json")["model"]["error"];
  EXPECT_LT(error["estimate_to_truth_m"]["rmse"], 1e-3);
  EXPECT_LT(error["truth_to_estimate_m"]["rmse"], 1e-3);
  ASSERT_EQ(error["shares"].size(), 3U);
  EXPECT_NEAR(error["shares"][0]["threshold_m"], 0.05, kFileRounding);
  EXPECT_EQ(error["shares"][0]["f_score"], 1);
}

TEST_F(Evaluate, RunPutsAllPartsIntoOneTableOneRecordAndOnePage) {
  const CommandResult result = Run("run run sequence --pictures pictures");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("mean depth 10.00 m, over 3 true depth maps"), HasSubstr("online"),
                    HasSubstr("F-score"), HasSubstr("oracle"), HasSubstr("below 11.25")));
  const Json json = ReadJson("run/evaluation.json");
  EXPECT_NEAR(json["mean_depth_m"], 10, kFileRounding);
  EXPECT_LT(json["trajectory"]["final"]["position_rmse_of_mean_depth"], kFileRounding);
  EXPECT_LT(json["trajectory"]["model"]["position_rmse_of_mean_depth"], kFileRounding);
  EXPECT_NEAR(json["depth"]["mean"]["l1_rel"], 0.01, kFileRounding);
  EXPECT_LT(json["model"]["model"]["rmse_of_mean_depth"], 1e-4);
  EXPECT_TRUE(json["left_out"].empty()) << json["left_out"];
  // Beside the model, and of its points: they lie on the truth, but for the registration.
  const std::string errors = ReadText(folder_ / "run/model_errors.ply");
  EXPECT_THAT(errors, HasSubstr("property float z\nproperty float error\nend_header\n"));
  const PointCloud model = ReadPly(folder_ / "run/model.ply");
  EXPECT_EQ(ReadPly(folder_ / "run/model_errors.ply").points, model.points);
  float last = 0;
  std::memcpy(&last, errors.data() + errors.size() - sizeof last, sizeof last);
  EXPECT_LT(last, 1e-3);
  EXPECT_GE(last, 0);
  for (const char* name : {"trajectory_final.png", "trajectory_model.png", "depth_only.png",
                           "confidence_only.png", "sparsification.svg", "model_beside_truth.png",
                           "model_two_colours.png", "model_by_distance.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / "pictures" / name)) << name;
  }
}

// Sixteen more frames in which the camera stands where it began; of every second there is a true
// depth map.
void StandAfterwards(const SmallRun& paths) {
  const std::filesystem::path truth = paths.sequence / "groundtruth.txt";
  std::vector<StampedPose> poses = ReadTrajectory(truth);
  for (int frame = 5; frame < 21; ++frame) {
    poses.push_back({frame / 30.0, poses.front().T_world_cam});
    if (frame % 2 != 0) continue;
    const std::string name = (frame < 10 ? "00000" : "0000") + std::to_string(frame) + ".pfm";
    std::filesystem::copy_file(paths.sequence / "depth/000000.pfm",
                               paths.sequence / "depth" / name);
  }
  WriteTrajectory(truth, poses);
}

TEST_F(Evaluate, TheModelIsJudgedByWhatFiveFramesSee) {
  StandAfterwards(paths_);
  const CommandResult result = Run("run run sequence --no-report");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("completeness of what 5 frames see"));
  const Json surface = ReadJson("run/evaluation.json")["model"]["model"]["whole_surface"];
  EXPECT_EQ(surface["views_are"], "true depth maps");
  EXPECT_EQ(surface["views"], 11);
  EXPECT_NEAR(surface["frames_per_view"], 21.0 / 11, kFileRounding);
  EXPECT_EQ(surface["min_views"], 3) << "three views speak for five frames";
  EXPECT_EQ(surface["added_points"], 0) << "pixels are 0.25 m apart, points 0.2 m";
  EXPECT_GT(surface["seen_points"], 0);
  EXPECT_LT(surface["seen_points"], surface["points"]);
  EXPECT_EQ(surface["shares"][1]["completeness_of_seen"], 1);
  EXPECT_EQ(surface["shares"][1]["f_score_of_seen"], 1);
}

TEST_F(Evaluate, WithoutTrueDepthMapsTheTrueCloudTellsWhatIsSeen) {
  StandAfterwards(paths_);
  std::filesystem::remove_all(folder_ / "sequence/depth");
  const CommandResult result = Run("run run sequence --no-report --mean-depth 10");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const Json surface = ReadJson("run/evaluation.json")["model"]["model"]["whole_surface"];
  EXPECT_EQ(surface["views_are"], "rendered true cloud");
  EXPECT_EQ(surface["views"], 21);
  EXPECT_EQ(surface["min_views"], 5);
  EXPECT_GT(surface["seen_points"], 0);
  EXPECT_LT(surface["seen_points"], surface["points"]);
  EXPECT_EQ(surface["shares"][1]["completeness_of_seen"], 1);
}

TEST_F(Evaluate, ThePageHoldsItsPicturesAndNeedsNoNetwork) {
  ASSERT_EQ(Run("run run sequence").exit_status, 0);
  const std::string page = ReadText(folder_ / "run/report.html");
  EXPECT_THAT(page, Not(HasSubstr("http:")));
  EXPECT_THAT(page, Not(HasSubstr("https:")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("</html>"));
  const auto count = [&page](const std::string& text) {
    int number = 0;
    for (auto at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++number;
    return number;
  };
  EXPECT_EQ(count("<figure "), 8);
  EXPECT_EQ(count("<img "), 7);
  EXPECT_EQ(count("src=\"data:image/png;base64,iVBORw0KGgo"), 7) << "PNG begins like this";
  EXPECT_EQ(count("src="), 7);
  EXPECT_EQ(count("<svg "), 1);
  EXPECT_EQ(count("alt=\"\""), 0) << "a picture without words";
}

TEST_F(Evaluate, RunSaysWhatIsLeftOutAndWhy) {
  std::filesystem::remove_all(paths_.sequence / "depth");
  std::filesystem::remove(paths_.run / "model.ply");
  const CommandResult result = Run("run run sequence --no-report");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("mean depth not known"), HasSubstr("no true depth maps"),
                    HasSubstr("the run made none")));
  EXPECT_FALSE(std::filesystem::exists(paths_.run / "report.html"));
  const Json json = ReadJson("run/evaluation.json");
  EXPECT_FALSE(json.contains("depth"));
  EXPECT_FALSE(json.contains("mean_depth_m"));
  EXPECT_EQ(json["left_out"].size(), 3U);
}

TEST_F(Evaluate, FurtherMapsOfARunHaveTheirOwnLines) {
  std::filesystem::copy(paths_.run / "trajectory.txt", paths_.run / "trajectory_map2.txt");
  ASSERT_EQ(Run("run run sequence --no-report").exit_status, 0);
  EXPECT_TRUE(ReadJson("run/evaluation.json")["trajectory"].contains("final map2"));
}

TEST_F(Evaluate, BadInputIsOneLineThatHelps) {
  ExpectError("", kWrongUsage, "subcommand", "--help");
  ExpectError("run run", kWrongUsage, "SEQUENCE");
  ExpectError("run run sequence --no-such-option", kWrongUsage, "--no-such-option");
  ExpectError("run none sequence", kFailure, "none: no such folder");
  ExpectError("run sequence/depth sequence", kFailure, "not the output of a reconstruction");
  ExpectError("run run run/depth", kFailure, "no truth to compare with");
  ExpectError("run run sequence --align sim4", kWrongUsage, "sim4");
  ExpectError("run run sequence --mean-depth -3", kWrongUsage, "--mean-depth", "found -3");
  ExpectError("trajectory none.txt sequence/groundtruth.txt", kFailure, "none.txt");
  ExpectError("trajectory run/model.ply sequence/groundtruth.txt", kFailure, "model.ply");
  ExpectError("depth run/depth run", kFailure, "no depth images in the folder");
  ExpectError("depth run/depth sequence/depth --scaling all", kWrongUsage, "map, run or none",
              "found all");
  ExpectError("cloud run/model.ply sequence/camera.yaml", kFailure, "camera.yaml");
  ExpectError("cloud run/model.ply sequence/cloud.ply --est-trajectory run/trajectory.txt",
              kWrongUsage, "--truth-trajectory");
}

TEST_F(Evaluate, FilesThatDoNotFitAreNamed) {
  WriteText(folder_ / "late.txt", "100 0 0 0 0 0 0 1\n101 1 0 0 0 0 0 1\n102 2 1 0 0 0 0 1\n");
  ExpectError("trajectory late.txt sequence/groundtruth.txt", kFailure, "late.txt", "too few");
  std::filesystem::rename(paths_.run / "depth/000002.depth.pfm",
                          paths_.run / "depth/000003.depth.pfm");
  ExpectError("depth run/depth sequence/depth", kFailure, "same number", "from 3");
  WriteText(folder_ / "run/run.json", "no JSON");
  ExpectError("run run sequence", kFailure, "run.json", "JSON");
}

}  // namespace
}  // namespace mono3d
