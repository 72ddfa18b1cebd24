// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What mono3d-bench says of place recognition: its truth on a wall, and a small sequence.

#include "bench/place_bench.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "bench/place_truth.h"
#include "mono3d/core/error.h"
#include "tools/command.h"

namespace mono3d::tools {
namespace {

using testing::HasSubstr;

// A wall 10 ahead of cameras that look at it squarely, 384 px and 10 wide: 16 columns of points.
PlaceTruth WallTruth(const std::vector<double>& x, float depth_of_second = 10) {
  CameraModel camera;
  camera.width = 384;
  camera.fx = camera.fy = 384;
  camera.height = 192;
  camera.cx = 191.5;
  camera.cy = 95.5;
  std::vector<Pose> poses;
  for (const double at : x)
    poses.emplace_back(Eigen::Matrix3d::Identity(), Eigen::Vector3d(at, 0, 0));
  std::map<std::int64_t, cv::Mat> depth;
  depth[0] = cv::Mat(192, 384, CV_32FC1, cv::Scalar(10));
  depth[1] = cv::Mat(192, 384, CV_32FC1, cv::Scalar(static_cast<double>(depth_of_second)));
  return {camera, poses, depth};
}

TEST(PlaceTruth, SharesWhatBothShow) {
  // A quarter of the way: 4 of 16 columns leave the picture.
  const PlaceTruth truth = WallTruth({0, 2.5, 10.1});
  EXPECT_DOUBLE_EQ(truth.SharedShare(0, 1, 30), 0.75);
  EXPECT_DOUBLE_EQ(truth.SharedShare(1, 0, 30), 0.75);
  EXPECT_DOUBLE_EQ(truth.SharedShare(0, 0, 0.1), 1);
  EXPECT_DOUBLE_EQ(truth.SharedShare(0, 2, 180), 0);
  EXPECT_DOUBLE_EQ(truth.MeanDepth(0), 10);
  EXPECT_THROW(static_cast<void>(truth.SharedShare(0, 3, 30)), Error);
}

TEST(PlaceTruth, DoesNotShareWhatIsSeenFromAside) {
  // Each point is seen from 10 to 15 degrees aside.
  EXPECT_DOUBLE_EQ(WallTruth({0, 2.5}).SharedShare(0, 1, 9), 0);
  EXPECT_DOUBLE_EQ(WallTruth({0, 2.5}).SharedShare(0, 1, 15), 0.75);
}

TEST(PlaceTruth, DoesNotShareWhatIsHidden) {
  EXPECT_DOUBLE_EQ(WallTruth({0, 2.5}, 5).SharedShare(0, 1, 30), 0);
}

TEST(PlaceCounts, GiveRecallOfRevisitsAlone) {
  std::vector<PlaceCounts> counts(3);
  counts[0] = {{}, PlaceClass::kWithin10, 10, 9, 8, 0, 0};
  counts[1] = {{}, PlaceClass::kLess, 100, 0, 1, 2, 0};
  counts[2] = {"elsewhere", PlaceClass::kElsewhere, 50, 0, 0, 1, 0};
  EXPECT_DOUBLE_EQ(*Recall(counts), 0.8);
  EXPECT_EQ(NumWrong(counts), 3);
  EXPECT_FALSE(Recall({counts[1], counts[2]}).has_value());
}

TEST(PlaceBench, AsksForTheSecondHalfOfASequence) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_place_bench";
  std::filesystem::remove_all(folder);
  const CommandResult simulated =
      RunCommand(std::string(MONO3D_SIMULATE_TOOL) +
                     " --camera.width 320 --camera.height 192 --fps 1 --max-frames 24"
                     " --depth-stride 6 --render.samples_per_side 1 -o " +
                     folder.string(),
                 std::filesystem::path(testing::TempDir()));
  ASSERT_EQ(simulated.exit_status, 0) << simulated.errors;
  const CommandResult run = RunCommand(
      std::string(MONO3D_BENCH_TOOL) + " places " + folder.string() + " --other " +
          folder.string() + " --query-stride 4 --json " + (folder / "places.json").string(),
      std::filesystem::path(testing::TempDir()));
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  const Json json = Json::parse(ReadText(folder / "places.json"));
  for (const char* asked_by : {"asked_by_images", "asked_by_keyframes"}) {
    // The flight goes on without a gap: all of it is known from less than 10 degrees aside.
    EXPECT_GE(json[asked_by]["recall"], 0.75) << asked_by;
    EXPECT_GE(json[asked_by]["classes"][0]["asked"], 3) << asked_by;
    // Given as another place, the same images must count as wrong.
    const Json& other = json[asked_by]["classes"].back();
    EXPECT_EQ(other["shows"], "mono3d_place_bench");
    EXPECT_GE(other["wrong"], 3) << asked_by;
    EXPECT_EQ(json[asked_by]["wrong"], other["wrong"]) << asked_by;
  }
  EXPECT_THAT(run.output, HasSubstr("Recall of revisits"));
  std::filesystem::remove_all(folder);
}

TEST(PlaceBench, RefusesASequenceWithoutTrueDepth) {
  PlaceBenchOptions options;
  options.folder = MONO3D_EXAMPLE;
  try {
    static_cast<void>(BenchPlaces(options));
    FAIL() << "the shipped sequence has no true depth";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no true depth"));
  }
}

}  // namespace
}  // namespace mono3d::tools
