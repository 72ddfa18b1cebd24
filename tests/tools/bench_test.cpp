// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-bench and mono3d-evaluate on the shipped sequence, and what the bench makes of results.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "bench/process.h"
#include "bench/suite_page.h"
#include "tools/command.h"

namespace mono3d::tools {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Small images and few frames keep the test short; the chain is the same.
constexpr const char* kSmallBench =
    " -- --resize 384x224 --max-frames 40 --tracking.features.num_features 600";
constexpr double kClockTick_ms = 20;  // the clocks of a process and of its threads differ by less

// A suite of the shipped sequence and one that is none, run once for all tests.
class BenchRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = std::filesystem::path(testing::TempDir()) / "mono3d_bench_run";
    std::filesystem::remove_all(folder());
    std::filesystem::create_directories(folder() / "suite/broken/images");
    std::filesystem::copy(std::filesystem::path(MONO3D_EXAMPLE) / "camera.yaml",
                          folder() / "suite/broken");
    WriteText(folder() / "suite/broken/images/0.jpg", "I am no image.\n");
    std::filesystem::create_directory_symlink(MONO3D_EXAMPLE, folder() / "suite/village");
    result() = Bench("--markdown table.md");
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder()); }

  static CommandResult Bench(const std::string& options) {
    return RunCommand("cd " + folder().string() + " && " + MONO3D_BENCH_TOOL +
                          " suite suite -o out " + options + kSmallBench,
                      folder());
  }
  static Json ReadJson(const std::string& name) {
    return Json::parse(std::ifstream(folder() / name));
  }

  static std::filesystem::path& folder() {
    static std::filesystem::path path;
    return path;
  }
  static CommandResult& result() {
    static CommandResult value;
    return value;
  }
};

TEST_F(BenchRun, GoesOnAfterABrokenSequenceAndSaysWhy) {
  ASSERT_EQ(result().exit_status, 0) << result().errors;
  EXPECT_THAT(result().errors, AllOf(HasSubstr("broken: mono3d-reconstruct: error: "),
                                     HasSubstr("village: success")));
  const Json json = ReadJson("out/bench.json");
  ASSERT_EQ(json["sequences"].size(), 2U);
  EXPECT_EQ(json["sequences"][0]["success"], false);
  EXPECT_THAT(json["sequences"][0]["reason"].get<std::string>(), HasSubstr("too few images"));
  EXPECT_EQ(json["sequences"][1]["success"], true);
  EXPECT_GT(json["sequences"][1]["tracked_share"], 0.9);
  EXPECT_GT(json["sequences"][1]["share_of_frames_used"], 0);
}

TEST_F(BenchRun, ThePapersFiguresStandBesideOurs) {
  const std::string table = ReadText(folder() / "table.md");
  for (const char* figure : {"| mono3d | 1 | 2 | 50.00 % |", "| paper, synthetic | 47 | 51 |",
                             "1.48 (1.776 %)", "0.744 (0.892 %)", "0.876", "2.03 %", "village"}) {
    EXPECT_THAT(table, HasSubstr(figure));
    if (figure[0] != '|') {
      EXPECT_THAT(result().output, HasSubstr(figure));
    }
  }
}

TEST_F(BenchRun, TheOverviewNamesNoAddressAndLinksToEveryReport) {
  const std::string page = ReadText(folder() / "out/index.html");
  EXPECT_THAT(page, AllOf(HasSubstr("href=\"village/report.html\""), HasSubstr("<img "),
                          Not(HasSubstr("http:")), Not(HasSubstr("https:"))));
  EXPECT_TRUE(std::filesystem::exists(folder() / "out/village/report.html"));
}

TEST_F(BenchRun, TheEvaluationOfTheShippedSequenceIsNearItsTruth) {
  // 40 frames of a flight at 88 m mean depth: half a percent of that.
  constexpr double kMaxRmse_m = 0.44;
  const Json evaluation = ReadJson("out/village/evaluation.json");
  for (const char* name : {"final", "online", "model"}) {
    EXPECT_LT(evaluation["trajectory"][name]["position_m"]["rmse"], kMaxRmse_m) << name;
  }
  EXPECT_FALSE(evaluation.contains("model")) << "the sequence ships no true cloud";
  EXPECT_EQ(evaluation["left_out"].size(), 2U);
}

TEST_F(BenchRun, ResumingKeepsWhatIsThere) {
  const auto time = std::filesystem::last_write_time(folder() / "out/village/model.ply");
  const CommandResult again = Bench("--resume --only 'vil*'");
  ASSERT_EQ(again.exit_status, 0) << again.errors;
  EXPECT_EQ(std::filesystem::last_write_time(folder() / "out/village/model.ply"), time);
  EXPECT_THAT(again.output, HasSubstr("100.00 %"));
}

TEST_F(BenchRun, FoldersWithoutSequencesAreNamed) {
  const CommandResult other = Bench("--only 'no such*'");
  EXPECT_EQ(other.exit_status, 1);
  EXPECT_THAT(other.errors, AllOf(HasSubstr("no such*"), HasSubstr("2 of other names")));
  const CommandResult empty =
      RunCommand(std::string(MONO3D_BENCH_TOOL) + " suite " + (folder() / "out").string() + " -o " +
                     (folder() / "out2").string(),
                 folder());
  EXPECT_EQ(empty.exit_status, 1);
  EXPECT_THAT(empty.errors, HasSubstr("no sequence in the folder"));
}

// Records of a run without fault at 100 m mean depth.
Json GoodRun() {
  return Json::parse(R"({"end": "finished", "counts": {"frames": 200, "depth_maps": 10},
    "maps": [{"frames": 190, "surfels": 1000}], "times": {"wall_s": 10, "cpu_s": 16},
    "stages": {"depth/estimate": {"calls": 10, "wall_ms": 2500}}})");
}
Json GoodEvaluation(double rmse_m = 1) {
  Json json = {{"mean_depth_m", 100}};
  for (const char* name : {"final", "model"}) {
    json["trajectory"][name]["position_m"] = {{"rmse", rmse_m}, {"mean", 0.8}, {"sigma", 0.6}};
  }
  json["depth"]["mean"] = {{"rmse_m", 4}, {"l1_rel", 0.02}, {"delta_1.25", 1}, {"delta_1.05", 0.9}};
  json["model"]["model"]["error"]["estimate_to_truth_m"] = {{"rmse", 0.5}};
  return json;
}

TEST(SequenceResult, TakesItsFiguresFromTheRecords) {
  const SequenceResult result = ReadSequenceResult("a", GoodRun(), GoodEvaluation());
  EXPECT_TRUE(result.is_success) << result.reason;
  EXPECT_DOUBLE_EQ(result.tracked_share, 0.95);
  EXPECT_DOUBLE_EQ(result.model_trajectory.rmse.value(), 0.01);
  EXPECT_DOUBLE_EQ(result.depth_rmse.value(), 0.04);
  EXPECT_DOUBLE_EQ(result.model.rmse.value(), 0.005);
  EXPECT_DOUBLE_EQ(result.frames_per_s.value(), 20);
  EXPECT_DOUBLE_EQ(result.cpu_ms_per_frame.value(), 80);
  EXPECT_DOUBLE_EQ(result.ms_per_depth_map.value(), 250);
  EXPECT_DOUBLE_EQ(result.share_of_frames_used.value(), 0.05);
  EXPECT_FALSE(result.density.has_value());
}

TEST(SequenceResult, FailsByEachPartOfTheRule) {
  const auto reason = [](const Json& run, const Json& evaluation) {
    const SequenceResult result = ReadSequenceResult("a", run, evaluation);
    EXPECT_FALSE(result.is_success);
    return result.reason;
  };
  Json run = GoodRun();
  run["end"] = "failed";
  run["error"] = "disk full";
  EXPECT_THAT(reason(run, GoodEvaluation()), HasSubstr("disk full"));
  run = GoodRun();
  run["maps"][0]["frames"] = 99;
  EXPECT_THAT(reason(run, GoodEvaluation()), HasSubstr("only 49.5 %"));
  run = GoodRun();
  run["maps"][0]["surfels"] = 0;
  EXPECT_EQ(reason(run, GoodEvaluation()), "no model");
  EXPECT_THAT(reason(GoodRun(), GoodEvaluation(5.1)), HasSubstr("the trajectory is off by 5.1 %"));
  Json evaluation = GoodEvaluation();
  evaluation["model"]["model"]["error"]["estimate_to_truth_m"]["rmse"] = 6;
  EXPECT_THAT(reason(GoodRun(), evaluation), HasSubstr("the model is off by 6.0 %"));
  evaluation = GoodEvaluation();
  evaluation["trajectory"]["final"]["rotation_deg"]["rmse"] = 92;
  EXPECT_EQ(reason(GoodRun(), evaluation), "the trajectory is turned by 92.0 degrees");
}

TEST(SuiteTables, FailuresAreCountedAndLeftOutOfTheMeans) {
  const std::vector<SequenceResult> results = {
      ReadSequenceResult("a", GoodRun(), GoodEvaluation(1)),
      ReadSequenceResult("b", GoodRun(), GoodEvaluation(3)),
      ReadSequenceResult("c", GoodRun(), GoodEvaluation(90)), FailedSequence("d", "crashed")};
  const auto mean =
      MeanOverSuccesses(results, &SequenceResult::final_trajectory, &LengthErrors::rmse);
  ASSERT_TRUE(mean.has_value());
  EXPECT_EQ(mean->count, 2);
  EXPECT_DOUBLE_EQ(mean->mean, 0.02);
  EXPECT_NEAR(mean->sigma, 0.01, 1e-12);
  const std::vector<Table> tables = SuiteTables(results);
  const std::string successes = ToText(tables.at(0));
  EXPECT_THAT(successes, AllOf(HasSubstr("50.00 %"), HasSubstr("Failed: d: crashed"),
                               HasSubstr("Failed: c: the trajectory is off by 90.0 %")));
  // 2 % of 83.4 m.
  EXPECT_THAT(ToText(tables.at(1)), AllOf(HasSubstr("mean of 2"), HasSubstr("1.67 (2.000 %)")));
}

TEST(Process, ReportsExitSignalAndTimeLimit) {
  const std::filesystem::path log =
      std::filesystem::path(testing::TempDir()) / "mono3d_process.log";
  const std::atomic<bool> stop = false;
  const ProcessResult exited = RunProcess({"/bin/sh", "-c", "echo words; exit 3"}, log, 0, stop);
  EXPECT_EQ(exited.exit_status, 3);
  EXPECT_EQ(ReadText(log), "words\n");
  const ProcessResult crashed = RunProcess({"/bin/sh", "-c", "kill -SEGV $$"}, log, 0, stop);
  EXPECT_EQ(crashed.exit_status, -1);
  EXPECT_THAT(crashed.ending, HasSubstr("signal 11"));
  const ProcessResult late = RunProcess({"/bin/sleep", "60"}, log, 0.05, stop);
  EXPECT_EQ(late.exit_status, -1);
  EXPECT_THAT(late.ending, HasSubstr("time limit"));
  const std::atomic<bool> stopped = true;
  EXPECT_EQ(RunProcess({"/bin/sleep", "60"}, log, 0, stopped).ending, "stopped");
  EXPECT_THROW(RunProcess({"/no/such/program"}, log, 0, stop), std::exception);
  std::filesystem::remove(log);
}

TEST(TrackingBench, MeasuresWhatAFrameCostsAndHowFarItIsOff) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_tracking_bench";
  std::filesystem::create_directories(folder);
  const std::string command = std::string(MONO3D_BENCH_TOOL) + " tracking " + MONO3D_EXAMPLE +
                              " --mean-depth 30 --json " + (folder / "tracking.json").string();
  const CommandResult result = RunCommand(command, folder);
  EXPECT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("CPU of the tracking thread"),
                                   HasSubstr("tracking/local_bundle_adjustment")));
  const Json json = Json::parse(std::ifstream(folder / "tracking.json"));
  EXPECT_EQ(json.at("frames_with_pose"), json.at("frames"));
  EXPECT_EQ(json.at("maps"), 1);
  EXPECT_EQ(json.at("mean_depth_m"), 30);
  constexpr double kMaxError_m = 0.1;  // a third of a percent of that; broken tracking is far off
  EXPECT_LT(json.at("final_rmse_m").get<double>(), kMaxError_m);
  EXPECT_GE(json.at("cpu_ms_per_frame").get<double>() + kClockTick_ms,
            json.at("thread_cpu_ms_per_frame").get<double>());
  EXPECT_GT(json.at("stages").at("tracking/frame_tracking").at("calls"), 0);

  const CommandResult refused = RunCommand(command + " --stride 0", folder);
  EXPECT_EQ(refused.exit_status, 2);
  EXPECT_THAT(refused.errors, HasSubstr("stride"));
  std::filesystem::remove_all(folder);
}

TEST(DepthBench, MeasuresTheStagesOfAMap) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_depth_bench";
  std::filesystem::create_directories(folder);
  const std::string command = std::string(MONO3D_BENCH_TOOL) + " depth " + MONO3D_EXAMPLE +
                              " --resize 192x112 --repeat 1 --json " +
                              (folder / "depth.json").string();
  const CommandResult result = RunCommand(command, folder);
  EXPECT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("192 x 112"), HasSubstr("depth/fine_sweep"),
                                   HasSubstr("times the CPU of OpenCV's StereoSGBM")));
  const Json json = Json::parse(std::ifstream(folder / "depth.json"));
  EXPECT_GT(json.at("map_cpu").at("least_ms").get<double>(), 0);
  EXPECT_TRUE(json.at("stages").contains("depth/fine_sgm"));

  const CommandResult too_far = RunCommand(command + " --step 30", folder);
  EXPECT_EQ(too_far.exit_status, 1);
  EXPECT_THAT(too_far.errors, HasSubstr("the images of the bundle leave the sequence"));

  const CommandResult even = RunCommand(command + " --images 4", folder);
  EXPECT_EQ(even.exit_status, 2);
  EXPECT_THAT(even.errors,
              HasSubstr("--images: option out of range (expected 3, 5, 7 or 9, found 4)"));
  std::filesystem::remove_all(folder);
}

TEST(FusionBench, MeasuresAMapACorrectionAndACoarserModel) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_fusion_bench";
  std::filesystem::create_directories(folder);
  const std::string command = std::string(MONO3D_BENCH_TOOL) +
                              " fusion --width 96 --height 64 --repeat 1 --json " +
                              (folder / "fusion.json").string();
  const CommandResult result = RunCommand(command + " --surfels 10000", folder);
  EXPECT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("96 x 64"), HasSubstr("fusion/associate"),
                    HasSubstr("Merging after the correction"), HasSubstr("becomes coarser")));
  const Json json = Json::parse(std::ifstream(folder / "fusion.json"));
  EXPECT_NEAR(json.at("surfels").get<double>(), 10'000, 500);
  EXPECT_EQ(json.at("refused_maps"), 0);
  EXPECT_GT(json.at("map_cpu").at("least_ms").get<double>(), 0);
  EXPECT_TRUE(json.at("wrong_map_stages").contains("fusion/register"));
  EXPECT_GT(json.at("correction").at("cpu_ms").get<double>(), 0);
  const auto& coarsening = json.at("coarsening");
  EXPECT_LT(coarsening.at("surfels_after").get<int>(), coarsening.at("surfels_before").get<int>());

  const CommandResult too_small = RunCommand(command + " --surfels 100", folder);
  EXPECT_EQ(too_small.exit_status, 2);
  EXPECT_THAT(too_small.errors, HasSubstr("--surfels"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace mono3d::tools
