// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/suite.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <variant>

#include "mono3d/core/error.h"
#include "synthetic/draws.h"
#include "synthetic/lens.h"
#include "synthetic/render.h"

namespace mono3d::synthetic {
namespace {

// All but the three that drones fly by themselves, which came later: suites stay as they are.
constexpr std::size_t kNumFlightKindsOfSuites = kFlightKinds.size() - 3;

TEST(DrawSpread, HasTheMeanSigmaAndRangeAskedFor) {
  RandomNumbers random(1);
  const std::vector<double> values =
      DrawSpread(400, {.mean = 3, .sigma = 1, .min = 1, .max = 8}, random);
  const Spread spread = Summarise(values);
  // What 400 slices cost in the tails.
  EXPECT_NEAR(spread.mean, 3, 0.01);
  EXPECT_NEAR(spread.sigma, 1, 0.02);
  EXPECT_GE(spread.min, 1);
  EXPECT_LE(spread.max, 8);
}

TEST(DrawSpread, RefusesWhatNoDistributionHas) {
  RandomNumbers random(1);
  EXPECT_THROW(DrawSpread(5, {.mean = 9, .sigma = 1, .min = 1, .max = 8}, random), Error);
  EXPECT_THROW(DrawSpread(5, {.mean = 4, .sigma = 7, .min = 1, .max = 8}, random), Error);
}

// Share of the paper's mean by which ours may differ, and of its standard deviation. The draws are
// tied together (an orbit's speed is its angular velocity times its radius), and 51 are few.
constexpr double kMeanShare = 0.15;
constexpr double kSigmaShare = 0.2;

void ExpectNear(const Spread& ours, const Spread& paper, const char* what) {
  EXPECT_NEAR(ours.mean, paper.mean, kMeanShare * paper.mean) << what;
  EXPECT_NEAR(ours.sigma, paper.sigma, kSigmaShare * paper.sigma) << what;
  // The ends: a tenth of the range.
  EXPECT_NEAR(ours.min, paper.min, 0.1 * (paper.max - paper.min)) << what;
  EXPECT_NEAR(ours.max, paper.max, 0.1 * (paper.max - paper.min)) << what;
}

TEST(Paper51, FliesAsThePaperDoes) {
  for (const int seed : {1, 2}) {
    const std::vector<SuiteSequence> suite = BuildSuite("paper51", seed);
    const FlightSamples samples = PlanFlights(suite);
    const FlightStatistics ours = Summarise(samples);
    const FlightStatistics paper = PaperFlights();
    ExpectNear(ours.height_m, paper.height_m, "height");
    ExpectNear(ours.angular_velocity_rad_per_s, paper.angular_velocity_rad_per_s, "angular");
    ExpectNear(ours.speed_m_per_s, paper.speed_m_per_s, "speed");
    ExpectNear(ours.frames_per_s, paper.frames_per_s, "frame rate");
    const auto num_images = static_cast<double>(samples.height_m.size());
    EXPECT_NEAR(num_images, kPaperImages, 0.06 * kPaperImages) << "\"about\" 24,000";
  }
}

TEST(Paper51, HasFiftyOneSequencesOfManyKindsWithNamesOfTheirOwn) {
  const std::vector<SuiteSequence> suite = BuildSuite("paper51", 1);
  EXPECT_EQ(suite.size(), 51U);
  std::set<std::string> names;
  std::set<std::string> scenes;
  std::set<std::string> flights;
  for (const SuiteSequence& sequence : suite) {
    EXPECT_NO_THROW(sequence.options.Validate()) << sequence.name;
    names.insert(sequence.name);
    scenes.insert(sequence.options.scene.kind);
    flights.insert(sequence.options.flight.kind);
    EXPECT_NE(sequence.name.find(sequence.options.scene.kind), std::string::npos);
    EXPECT_NE(sequence.name.find(sequence.options.flight.kind), std::string::npos);
  }
  EXPECT_EQ(names.size(), suite.size());
  EXPECT_EQ(scenes.size(), kSceneKinds.size());
  EXPECT_EQ(flights.size(), kNumFlightKindsOfSuites);
}

TEST(Paper51, IsTheSameForTheSameSeedOnly) {
  auto first = BuildSuite("paper51", 4);
  auto second = BuildSuite("paper51", 4);
  const auto other = BuildSuite("paper51", 5);
  EXPECT_EQ(PlanFlights(first).height_m, PlanFlights(second).height_m);
  EXPECT_EQ(first[30].name, second[30].name);
  EXPECT_NE(PlanFlights(first).height_m, PlanFlights(other).height_m);
}

TEST(Quick, HasFourSequencesOfFortyImages) {
  const std::vector<SuiteSequence> suite = BuildSuite("quick", 1);
  ASSERT_EQ(suite.size(), 4U);
  for (const SuiteSequence& sequence : suite) {
    EXPECT_EQ(PlanFrames(sequence.options).timestamps_s.size(), 40U) << sequence.name;
  }
}

bool IsWithin(double value, double low, double high) { return value >= low && value <= high; }

TEST(Cameras, AreOfAllKindsWithinTheirRanges) {
  for (const int seed : {1, 2, 3}) {
    const std::vector<SuiteSequence> suite = BuildSuite("cameras", seed);
    EXPECT_GE(suite.size(), 40U);
    std::set<std::string> names;
    std::set<std::string> scenes;
    std::set<std::string> flights;
    std::set<std::string> directions;
    std::map<double, int> readouts;
    Spread focal{.min = 9, .max = 0};
    Spread k1{.min = 9, .max = -9};
    int num_videos = 0;
    for (const SuiteSequence& sequence : suite) {
      const SequenceOptions& options = sequence.options;
      EXPECT_NO_THROW(options.Validate()) << sequence.name;
      EXPECT_NO_THROW(sequence.video.Validate()) << sequence.name;
      EXPECT_TRUE(sequence.uncalibrated);
      names.insert(sequence.name);
      scenes.insert(options.scene.kind);
      flights.insert(options.flight.kind);
      directions.insert(options.render.sensor.readout_direction);
      ++readouts[options.render.sensor.readout_s];
      num_videos += sequence.video.IsOn() ? 1 : 0;
      const SequenceCameraOptions& camera = options.camera;
      const int longer_side = std::max(camera.width, camera.height);
      focal.min = std::min(focal.min, camera.focal_px / longer_side);
      focal.max = std::max(focal.max, camera.focal_px / longer_side);
      const SensorOptions& sensor = options.render.sensor;
      const bool is_turned = sensor.readout_s > 0 && (sensor.readout_direction == "right" ||
                                                      sensor.readout_direction == "left");
      EXPECT_EQ(camera.height > camera.width, is_turned) << sequence.name;
      k1.min = std::min(k1.min, camera.k1);
      k1.max = std::max(k1.max, camera.k1);
      EXPECT_LE(std::abs(camera.offset_x_px), 0.02 * camera.width);
      EXPECT_LE(std::abs(camera.offset_y_px), 0.02 * camera.height);
      const auto num_images = static_cast<double>(PlanFrames(options).timestamps_s.size());
      EXPECT_TRUE(IsWithin(num_images, 120, 200)) << sequence.name;
    }
    EXPECT_EQ(names.size(), suite.size());
    EXPECT_EQ(scenes.size(), kSceneKinds.size());
    EXPECT_EQ(flights.size(), kNumFlightKindsOfSuites);
    EXPECT_EQ(directions.size(), kReadoutDirections.size());
    EXPECT_EQ(readouts, (std::map<double, int>{{0, 12}, {0.010, 12}, {0.020, 12}, {0.033, 12}}));
    EXPECT_TRUE(IsWithin(num_videos, 20, 42)) << num_videos;
    // Slices reach to a 48th of both ends.
    EXPECT_TRUE(IsWithin(focal.min, 0.55, 0.57) && IsWithin(focal.max, 1.28, 1.3));
    EXPECT_TRUE(IsWithin(k1.min, -0.3, -0.29) && IsWithin(k1.max, 0.09, 0.1));
  }
}

TEST(Cameras, HaveLensesThatCanBeInverted) {
  for (int seed = 1; seed <= 6; ++seed) {
    for (const SuiteSequence& sequence : BuildSuite("cameras", seed)) {
      // Distortion has no size in pixels: a small image has the same corners.
      const CameraModel large = sequence.options.camera.Model();
      const CameraModel camera = large.Resized(large.width / 9, large.height / 9);
      EXPECT_NO_THROW(Lens{camera}) << sequence.name;
      EXPECT_NO_THROW(DepthCamera(camera)) << sequence.name;
    }
  }
}

TEST(Cameras, AreTheSameForTheSameSeedOnly) {
  auto first = BuildSuite("cameras", 4);
  auto second = BuildSuite("cameras", 4);
  auto other = BuildSuite("cameras", 5);
  int num_same_focal = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].name, second[i].name);
    const auto fields = ListOptions(first[i].options);
    const auto again = ListOptions(second[i].options);
    ASSERT_EQ(fields.size(), again.size());
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const auto expect_equal = [&](auto* value) {
        EXPECT_EQ(*value, *std::get<decltype(value)>(again[k].value)) << fields[k].name;
      };
      std::visit(expect_equal, fields[k].value);
    }
    num_same_focal += first[i].options.camera.focal_px == other[i].options.camera.focal_px ? 1 : 0;
  }
  EXPECT_EQ(num_same_focal, 0);
}

TEST(Suite, RefusesAnUnknownName) { EXPECT_THROW(BuildSuite("paper52", 1), UsageError); }

TEST(PlanFrames, CutsOutTheMiddle) {
  SequenceOptions options;
  options.flight.duration_s = 10;
  const FrameTrack all = PlanFrames(options);
  options.max_frames = 31;
  const FrameTrack middle = PlanFrames(options);
  ASSERT_EQ(middle.timestamps_s.size(), 31U);
  EXPECT_NEAR(middle.timestamps_s[15], 0.5 * all.timestamps_s.back(), 1.0 / 30);
  EXPECT_NE(std::find(all.timestamps_s.begin(), all.timestamps_s.end(), middle.timestamps_s[0]),
            all.timestamps_s.end());
}

TEST(SequenceOptions, RefuseBadValues) {
  SequenceOptions options;
  options.frames_per_s = 0;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.camera.width = 3;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.depth_stride = 0;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.flight.kind = "swim";
  EXPECT_THROW(options.Validate(), UsageError);
}

TEST(SequenceCameraOptions, HaveTheCoefficientsOfTheirLens) {
  SequenceCameraOptions options;
  options.lens = "fisheye";
  options.k1 = 0.1;
  options.k3 = 0.3;
  options.k4 = 0.4;
  EXPECT_NO_THROW(options.Validate());
  const CameraModel camera = options.Model();
  EXPECT_EQ(camera.lens, LensModel::kFisheye);
  EXPECT_EQ(camera.distortion, (std::array<double, 5>{0.1, 0, 0.3, 0.4, 0}));
  EXPECT_EQ(camera.fx, 0.4 * options.width);
  options.p1 = 0.1;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.k4 = 0.4;
  EXPECT_THROW(options.Validate(), UsageError) << "a pinhole camera has none";
  options = {};
  options.lens = "wide";
  EXPECT_THROW(options.Validate(), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
