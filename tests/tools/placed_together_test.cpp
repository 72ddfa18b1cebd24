// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-reconstruct on images of a flight that cannot be followed from one to the next: the middle
// third of it is missing.

#include "reconstruct/placed_together.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kShippedFlight = MONO3D_EXAMPLE;
constexpr int kEach = 3;      // image of the flight
constexpr int kGapFrom = 20;  // these are missing
constexpr int kGapTo = 52;
constexpr std::size_t kNumBefore = 7;
constexpr std::size_t kNumBehind = 8;

class PlacedTogether : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_placed_together_") +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(Images());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Images() const { return folder_ / "images"; }
  std::filesystem::path Run() const { return folder_ / "run"; }

  // Each so many times, as a camera takes images that hardly moves.
  void Copy(int from, int to, int times = 1) {
    const std::vector<std::string> images = ListImages(kShippedFlight);
    for (int i = 0; i < static_cast<int>(images.size()); i += kEach) {
      if (i < from || i > to) continue;
      const std::filesystem::path image = images[static_cast<std::size_t>(i)];
      for (int k = 0; k < times; ++k) {
        std::filesystem::copy_file(image, Images() / (image.stem().string() + std::to_string(k) +
                                                      image.extension().string()));
      }
    }
  }

  CommandResult Reconstruct(const std::string& more = {}) {
    return RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + Images().string() +
                          " --camera " + (kShippedFlight / "camera.yaml").string() +
                          " --camera-fixed --resize 384x224 --tracking.features.num_features 600" +
                          " -o " + Run().string() + more,
                      folder_);
  }

  nlohmann::json Record() const { return nlohmann::json::parse(std::ifstream(Run() / "run.json")); }

  std::filesystem::path folder_;
};

TEST_F(PlacedTogether, AreAllInTheModelWhereTrackingBroke) {
  Copy(0, kGapFrom);
  Copy(kGapTo, 1000);
  const CommandResult tracked = Reconstruct(" --video");
  ASSERT_EQ(tracked.exit_status, 0) << tracked.errors;
  EXPECT_THAT(tracked.output, Not(HasSubstr("placed together")));
  EXPECT_THAT(tracked.output, HasSubstr("images without a pose 8, most frequent reason: "));
  EXPECT_THAT(tracked.output, HasSubstr("too little of the scene seen so far was found again"));
  EXPECT_EQ(ReadTrajectory(Run() / "trajectory.txt").size(), kNumBefore);
  EXPECT_EQ(Record()["options"]["fusion.registration.moves"], true);

  const CommandResult result = Reconstruct();
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("7 of 15 images could be followed from one to the next: all "
                                       "are placed together now"));
  EXPECT_EQ(ReadTrajectory(Run() / "trajectory.txt").size(), kNumBefore + kNumBehind);
  EXPECT_EQ(Record()["sparse_video"], true);
  EXPECT_EQ(Record()["end"], "finished");
  EXPECT_EQ(Record()["options"]["fusion.registration.moves"], false) << "of images placed together";
  EXPECT_GT(ReadPly(Run() / "model.ply").size(), 0U);
  for (const auto& entry : std::filesystem::directory_iterator(Run())) {
    EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr("unfinished")));
  }
}

TEST_F(PlacedTogether, AreSomeOfManyThatShowNothingNew) {
  constexpr std::size_t kTimes = 8;
  Copy(0, kGapFrom, kTimes);
  Copy(kGapTo, kGapTo + 3 * kEach, kTimes);
  const CommandResult result = Reconstruct();
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const std::size_t stride = Record()["options"]["stride"];
  EXPECT_GE(stride, 2U);
  EXPECT_LE(stride, kTimes / 2);
  EXPECT_THAT(result.output, HasSubstr("images could be followed from one to the next: one of " +
                                       std::to_string(stride) + " is placed together now"));
  const std::size_t num_images = kTimes * (kNumBefore + 3);
  EXPECT_EQ(ReadTrajectory(Run() / "trajectory.txt").size(), (num_images + stride - 1) / stride);
}

// A film that is cut from one place to another: the negatives of a mirror's images show none of the
// first one.
TEST_F(PlacedTogether, AreNotWhereMapsShowNothingInCommon) {
  constexpr std::size_t kNumOfPlace = 24;
  const std::vector<std::string> images = ListImages(kShippedFlight);
  for (std::size_t i = 0; i < kNumOfPlace; ++i) {
    const std::filesystem::path image = images[i];
    std::filesystem::copy_file(image, Images() / image.filename());
    cv::Mat negative = cv::imread(image.string());
    cv::flip(negative, negative, 1);
    cv::bitwise_not(negative, negative);
    cv::imwrite((Images() / ("9" + image.filename().string())).string(), negative);
  }
  // A new map is begun after a second without a pose.
  const CommandResult result = Reconstruct(" --fps 5");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, Not(HasSubstr("placed together")));
  EXPECT_THAT(result.output,
              HasSubstr(" of 48 images are in the model; the others are in 1 map of other places"));
  EXPECT_GE(ReadTrajectory(Run() / "trajectory.txt").size() +
                ReadTrajectory(Run() / "trajectory_map1.txt").size(),
            2 * kNumOfPlace - 3);
}

TEST_F(PlacedTogether, LeaveTheResultWhereTheyAreNoBetter) {
  Copy(0, kGapFrom);
  cv::RNG random(7);
  for (std::size_t i = 0; i < 3; ++i) {  // images of nothing
    cv::Mat noise(448, 768, CV_8UC3);
    random.fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::imwrite((Images() / ("9" + std::to_string(i) + "0000.png")).string(), noise);
  }
  const CommandResult result = Reconstruct();
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("7 of 10 images could be followed"));
  EXPECT_THAT(result.output, HasSubstr("7 images are in one map: the result of before stays"));
  EXPECT_EQ(Record()["sparse_video"], false);
  EXPECT_EQ(ReadTrajectory(Run() / "trajectory.txt").size(), kNumBefore);
  EXPECT_GT(ReadPly(Run() / "model.ply").size(), 0U);
  EXPECT_FALSE(std::filesystem::exists(Run() / "unfinished_1"));
}

TEST(RunOutcome, ABrokenModelOfMoreImagesIsNoBetterThanAWholeOne) {
  tools::RunOutcome tracked;
  tracked.is_whole = true;
  tracked.num_images = 200;
  tracked.num_in_model = 105;
  tools::RunOutcome together = tracked;
  together.num_in_model = 195;
  EXPECT_TRUE(together.IsBetterThan(tracked));
  EXPECT_FALSE(tracked.IsBetterThan(together));
  together.is_broken = true;
  EXPECT_FALSE(together.IsBetterThan(tracked));
  tracked.is_broken = true;
  EXPECT_TRUE(together.IsBetterThan(tracked));
  tracked.is_broken = false;
  tracked.is_whole = false;  // it has no model
  EXPECT_TRUE(together.IsBetterThan(tracked));
}

}  // namespace
}  // namespace mono3d
