// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/exposure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/core.hpp>
#include <random>

#include "fusion/fusion_scene.h"
#include "fusion/registration_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

using ::testing::HasSubstr;

ExposureCell CellOf(double image, double model, std::uint32_t num_surfels = 200) {
  const auto sum = [&](double grey) {
    return static_cast<std::uint32_t>(std::lround(4 * grey * num_surfels));
  };
  return {num_surfels, sum(image), sum(model), 0};
}

TEST(EstimateExposure, FindsGainAndOffsetAmongOutliers) {
  constexpr Exposure kTrue{0.6, 10};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> grey(20, 230);
  std::normal_distribution<double> noise(0, 1);
  std::vector<ExposureCell> cells;
  for (int i = 0; i < 200; ++i) {
    const double model = grey(random);
    // Three of ten show something else: a shadow, a reflection.
    const bool is_outlier = i % 10 < 3;
    const double image =
        is_outlier ? grey(random) : kTrue.gain * model + kTrue.offset + noise(random);
    cells.push_back(CellOf(image, model));
  }
  cells.push_back(CellOf(255, 40, 5));  // too few to say anything
  const Exposure found = EstimateExposure(cells, {});
  EXPECT_NEAR(found.gain, kTrue.gain, 0.015);
  EXPECT_NEAR(found.offset, kTrue.offset, 2);
}

TEST(EstimateExposure, KeepsTheGainBeforeWhereNothingIsSeen) {
  const Exposure found = EstimateExposure({}, {1.3, 8});
  EXPECT_EQ(found.gain, 1.3);
  EXPECT_EQ(found.offset, 0);
}

TEST(EstimateExposure, TakesAWallOfOneBrightnessForAGain) {
  const std::vector<ExposureCell> wall(50, CellOf(150, 100));
  const Exposure found = EstimateExposure(wall, {1.45, 0});
  EXPECT_NEAR(found.gain * 100 + found.offset, 150, 0.5);
  EXPECT_NEAR(found.gain, 1.5, 0.05);
}

TEST(EstimateExposure, RefusesAnImpossibleGain) {
  std::vector<ExposureCell> cells;
  for (int i = 0; i < 50; ++i) cells.push_back(CellOf(5 + 4 * i, 2 + 0.5 * i));
  const Exposure found = EstimateExposure(cells, {0.9, 4});
  EXPECT_EQ(found.gain, 0.9);
  EXPECT_EQ(found.offset, 0);
}

TEST(ExposureSample, TakesAllOfFewAndSpreadsTheRestEvenly) {
  std::vector<std::uint32_t> blocks(9600);
  std::iota(blocks.begin(), blocks.end(), 100);
  EXPECT_EQ(ExposureSample(blocks, 2439), blocks);  // 63 * 4 * 2439 surfels: all
  const auto sample = ExposureSample(blocks, 336);
  // 63 * 4 * 336 surfels of 64 * 9600, in blocks.
  EXPECT_NEAR(static_cast<double>(sample.size()), 63 * 4 * 336 / 64.0, 5);
  // Rows of 12 blocks, as of an image 768 wide: each column has its share.
  std::array<int, 12> of_column{};
  for (const std::uint32_t block : sample) ++of_column[(block - 100) % 12];
  for (const int count : of_column) EXPECT_NEAR(count, static_cast<double>(sample.size()) / 12, 8);
}

TEST(CorrectedColours, UndoesTheExposureAndKeepsClippedValues) {
  cv::Mat bgr(1, 2, CV_8UC3);
  bgr.at<cv::Vec3b>(0, 0) = cv::Vec3b(10, 70, 130);
  bgr.at<cv::Vec3b>(0, 1) = cv::Vec3b(0, 255, 254);
  const std::vector<std::uint32_t> colours = CorrectedColours(bgr, {0.6, 10});
  ASSERT_EQ(colours.size(), 2U);
  EXPECT_EQ(colours[0], 200U | 100U << 8 | 0U << 16);
  EXPECT_EQ(colours[1], 255U | 255U << 8 | 0U << 16);
  EXPECT_EQ(CorrectedColours(bgr, {1.2, 0})[1], 212U | 255U << 8 | 0U << 16);
}

TEST(ExposureCells, EqualReference) {
  for (const auto& [width, height] : {std::pair{17, 33}, {96, 56}, {500, 40}}) {
    StageScene scene(width, height, 11);
    scene.RunAssociate();
    scene.kernels.ExposureCells(scene.recorder, scene.view, scene.buffers,
                                scene.buffers.exposure_cells, scene.storage, scene.all_blocks);
    scene.recorder.Submit();
    const auto expected = reference::ExposureCells(scene.view, scene.packed,
                                                   scene.DeviceAssociation(), scene.surfels);
    EXPECT_EQ(scene.buffers.exposure_cells.Download<ExposureCell>(), expected);
    const auto count = [](std::uint32_t sum, const ExposureCell& cell) { return sum + cell[0]; };
    EXPECT_GT(std::accumulate(expected.begin(), expected.end(), 0U, count), 100U);
  }
}

TrackedMap Exposed(TrackedMap view, double gain, double offset) {
  view.bgr = cv::Mat(view.bgr * gain + cv::Scalar::all(offset));  // not into the shared pixels
  return view;
}

TEST(FusionExposure, TakesADarkImageLikeTheOthers) {
  const auto with = CreateTrackedModel();
  const auto without = CreateTrackedModel();
  (void)with->Integrate(HouseView({}, 0));
  (void)without->Integrate(HouseView({}, 0));
  const TrackedMap view =
      Misplaced(HouseView({}, 4), {0.006, -0.008, 0.005}, {0.06, -0.05, 0.04}, 1.02);
  const FusionResult dark = with->Integrate(Exposed(view, 0.6, 10));
  const FusionResult same = without->Integrate(view);
  ASSERT_EQ(dark.status, FusionStatus::kFused) << dark.reason;
  ASSERT_EQ(same.status, FusionStatus::kFused) << same.reason;
  // From the darkest place to the brightest.
  for (const double grey : {40, 120, 200}) {
    EXPECT_NEAR(dark.exposure_gain * grey + dark.exposure_offset, 0.6 * grey + 10, 2.5);
  }
  EXPECT_NEAR(same.exposure_gain, 1, 0.02);
  EXPECT_NEAR(same.exposure_offset, 0, 2);
  EXPECT_EQ(dark.registration.moved, same.registration.moved);
  EXPECT_LT(ImageDistance_px(dark.S_world_kf.pose(), same.S_world_kf.pose()), 0.03);
  EXPECT_NEAR(dark.registration.grey_residual, same.registration.grey_residual, 0.1);
}

// The surface fits, the picture does not: another exposure is no excuse for that.
TEST(FusionExposure, RefusesAnotherPicture) {
  const auto map = CreateTrackedModel();
  (void)map->Integrate(HouseView({}, 0));
  (void)map->Integrate(HouseView({}, 2));
  TrackedMap other = HouseView({}, 4);
  cv::Mat upside_down(other.bgr.size(), other.bgr.type());
  for (int y = 0; y < other.bgr.rows; ++y) {
    other.bgr.row(other.bgr.rows - 1 - y).copyTo(upside_down.row(y));
  }
  other.bgr = upside_down;
  const FusionResult result = map->Integrate(other);
  EXPECT_EQ(result.status, FusionStatus::kRejected);
  EXPECT_THAT(result.reason, HasSubstr("grey value from the model"));
}

double MeanGrey(const PointCloud& cloud) {
  double sum = 0;
  for (const auto& colour : cloud.colours) sum += colour[1];
  return sum / static_cast<double>(cloud.colours.size());
}

// A flight around half of the house: what the last views show, the first ones did not.
TEST(FusionExposure, KeepsTheModelsColoursWhereTheExposureDrifts) {
  constexpr double kTolerance = 3;  // grey values
  const auto drifting = CreateTrackedModel();
  const auto constant = CreateTrackedModel();
  for (int i = 0; i <= 30; ++i) {
    const TrackedMap view = HouseView({}, 6 * i);
    // From 0.5 up to 1.05 and back, each view some 5 % from the one before.
    const double gain = 0.8 + 0.25 * std::cos(2 * std::numbers::pi * i / 30.0);
    const FusionResult result = drifting->Integrate(Exposed(view, gain, 10 - gain * 5));
    ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
    (void)constant->Integrate(Exposed(view, 1.05, 10 - 1.05 * 5));
  }
  const PointCloud found = drifting->Export(2);
  const PointCloud expected = constant->Export(2);
  EXPECT_NEAR(MeanGrey(found), MeanGrey(expected), kTolerance);
  // Those of the last views, which are at the end.
  ASSERT_EQ(found.colours.size(), expected.colours.size());
  double difference = 0;
  const std::size_t first = found.colours.size() - found.colours.size() / 4;
  for (std::size_t i = first; i < found.colours.size(); ++i) {
    difference += std::abs(found.colours[i][1] - expected.colours[i][1]);
  }
  EXPECT_LT(difference / static_cast<double>(found.colours.size() - first), kTolerance);
}

}  // namespace
}  // namespace mono3d
