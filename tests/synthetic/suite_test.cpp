// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/suite.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "mono3d/core/error.h"
#include "synthetic/draws.h"

namespace mono3d::synthetic {
namespace {

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
  EXPECT_EQ(flights.size(), kFlightKinds.size());
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

}  // namespace
}  // namespace mono3d::synthetic
