// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/suite.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "synthetic/draws.h"
#include "synthetic/numbers.h"
#include "synthetic/suite_cameras.h"
#include "synthetic/suite_features.h"
#include "synthetic/words.h"

namespace mono3d::synthetic {
namespace {

// How many sequences of paper51 fly in which way. The paper's all orbit; so do most of these.
struct KindCount {
  const char* kind;
  int count;
};
constexpr std::array<KindCount, 6> kFlightShares = {{{"orbit", 31},
                                                     {"lateral", 8},
                                                     {"lawnmower", 2},
                                                     {"cruise", 6},
                                                     {"stop_and_turn", 2},
                                                     {"take_off", 2}}};

// What the flights are drawn from, so that frames of all of them together have the spreads of the
// paper's table. Angular velocity and speed depend on each other on an orbit: there the speed
// follows from angular velocity and radius, the radius from height and pitch.
constexpr Spread kHeights_m{.mean = 70, .sigma = 31, .min = 23, .max = 134};
constexpr Spread kRates_per_s{.mean = 2.33, .sigma = 0.4, .min = 0.45, .max = 3.4};
constexpr Spread kOrbitTurns_rad_per_s{.mean = 0.0193, .sigma = 0.005, .min = 0.004, .max = 0.05};
constexpr Spread kStraightSpeeds_m_per_s{.mean = 2.2, .sigma = 0.8, .min = 0.6, .max = 4.7};
constexpr double kStraightPitch_deg = 12;  // steeper than an orbit: nearer to the mean depth
constexpr double kTypicalRadius_m = 64;
constexpr Spread kPitches_deg{.mean = 49, .sigma = 5, .min = 40, .max = 60};
constexpr double kRateSigma_per_s = 0.26;  // within one sequence
constexpr int kImagesPerSequence = 570;
constexpr double kLongestPath_m = 300;  // of a straight flight: the scene ends somewhere
constexpr double kFastestTurn_rad_per_s = 0.0935;
constexpr double kFastestRowTurn_rad_per_s = 0.055;  // half a circle, at full speed
constexpr double kFastestLawnmower_m_per_s = 1.4;
constexpr double kClimb_m_per_s = 1;

struct FlightDraw {
  std::string kind;
  double height_m;
  double rate_per_s;
  double turn_rad_per_s;
  double straight_speed_m_per_s;
  double pitch_deg;
};

std::vector<FlightDraw> DrawFlights(RandomNumbers& random) {
  std::vector<std::string> kinds;
  for (const KindCount& share : kFlightShares) {
    kinds.insert(kinds.end(), static_cast<std::size_t>(share.count), share.kind);
  }
  Shuffle(kinds, random);
  const int count = static_cast<int>(kinds.size());
  const int num_orbits = kFlightShares[0].count;
  const std::vector<double> heights = DrawSpread(count, kHeights_m, random);
  std::vector<double> rates = DrawSpread(count, kRates_per_s, random);
  const std::vector<double> pitches = DrawSpread(count, kPitches_deg, random);
  std::vector<double> turns = DrawSpread(num_orbits, kOrbitTurns_rad_per_s, random);
  std::vector<double> speeds = DrawSpread(count - num_orbits, kStraightSpeeds_m_per_s, random);
  // One flight each at the ends of the paper's ranges, which the middles of slices do not reach.
  *std::min_element(rates.begin(), rates.end()) = kRates_per_s.min;
  *std::max_element(speeds.begin(), speeds.end()) = kStraightSpeeds_m_per_s.max;
  std::vector<FlightDraw> draws;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    FlightDraw draw{kinds[i], heights[i], rates[i], 0, 0, pitches[i]};
    std::vector<double>& own = draw.kind == "orbit" ? turns : speeds;
    (draw.kind == "orbit" ? draw.turn_rad_per_s : draw.straight_speed_m_per_s) = own.back();
    own.pop_back();
    draws.push_back(draw);
  }
  return draws;
}

void SetOrbit(FlightOptions& flight, const FlightDraw& draw, RandomNumbers& random) {
  flight.radius_m = draw.height_m / std::tan(Radians(draw.pitch_deg));
  // Wide circles are flown faster, but not in proportion.
  flight.speed_m_per_s =
      draw.turn_rad_per_s * kTypicalRadius_m * std::pow(flight.radius_m / kTypicalRadius_m, 0.6);
  flight.start_deg = random.Uniform(0, 360);
  // Where the time is enough for a full circle, it is flown and closed.
  flight.full_circle =
      flight.speed_m_per_s * flight.duration_s > 2 * std::numbers::pi * flight.radius_m;
}

void SetStraight(FlightOptions& flight, const FlightDraw& draw, RandomNumbers& random) {
  flight.speed_m_per_s = draw.straight_speed_m_per_s;
  flight.heading_deg = random.Uniform(0, 360);
  flight.pitch_deg = draw.pitch_deg + kStraightPitch_deg;
  if (flight.kind == "lawnmower") {
    flight.speed_m_per_s = std::min(flight.speed_m_per_s, kFastestLawnmower_m_per_s);
    flight.row_spacing_m = 2 * flight.speed_m_per_s / kFastestRowTurn_rad_per_s;
  } else {
    flight.duration_s = std::min(flight.duration_s, kLongestPath_m / flight.speed_m_per_s);
  }
  if (flight.kind == "stop_and_turn") {
    flight.turn_deg_per_s = 0.95 * kFastestTurn_rad_per_s * 180 / std::numbers::pi;
  }
  if (flight.kind == "take_off") {
    flight.take_off_height_m = kHeights_m.min;
    flight.height_m = std::max(flight.height_m, 4 * kHeights_m.min);
    flight.speed_m_per_s = kClimb_m_per_s;
    flight.duration_s =
        flight.ramp_s + (flight.height_m - flight.take_off_height_m) / kClimb_m_per_s;
  }
}

SequenceOptions Fly(const FlightDraw& draw, int seed, RandomNumbers& random) {
  SequenceOptions options;
  SetSeeds(options, seed);
  options.frames_per_s = draw.rate_per_s;
  options.frames_sigma_per_s = std::min(kRateSigma_per_s, 0.4 * draw.rate_per_s);
  FlightOptions& flight = options.flight;
  flight.kind = draw.kind;
  flight.height_m = draw.height_m;
  flight.duration_s = kImagesPerSequence / draw.rate_per_s;
  // Swings of ten seconds and more: a steady hand at a few images a second.
  flight.unsteadiness.lowest_hz = 0.02;
  flight.unsteadiness.highest_hz = 0.1;
  flight.unsteadiness.position_m = random.Uniform(0, 0.4);
  flight.unsteadiness.rotation_deg = random.Uniform(0, 0.6);
  if (draw.kind == "orbit") {
    SetOrbit(flight, draw, random);
  } else {
    SetStraight(flight, draw, random);
  }
  return options;
}

std::string Name(const std::string& suite, std::size_t index, const SequenceOptions& options,
                 const std::string& feature) {
  const std::string number = (index < 10 ? "0" : "") + std::to_string(index);
  return suite + "_" + number + "_" + options.scene.kind + "_" + options.flight.kind + "_" +
         feature;
}

std::vector<SuiteSequence> BuildPaper51(int seed) {
  RandomNumbers random(static_cast<std::uint64_t>(seed));
  const std::vector<FlightDraw> draws = DrawFlights(random);
  const std::vector<std::string> features = DrawFeatures(draws.size(), random);
  std::vector<SuiteSequence> suite;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    SuiteSequence sequence;
    const int sequence_seed = 1000 * seed + static_cast<int>(i) + 1;
    sequence.options = Fly(draws[i], sequence_seed, random);
    ChooseScene(sequence.options, features[i], i);
    sequence.jpeg_quality = SpoilCamera(sequence.options, random);
    sequence.name = Name("paper51", i + 1, sequence.options, features[i]);
    suite.push_back(sequence);
  }
  return suite;
}

// 40 images, a degree or a metre from one to the next, at half the size in each direction.
std::vector<SuiteSequence> BuildQuick(int seed) {
  struct Plan {
    const char* scene;
    const char* flight;
    const char* feature;
    double height_m;
    double speed_m_per_s;
  };
  constexpr std::array<Plan, 4> kPlans = {{{"village", "orbit", "plain", 50, 2.5},
                                           {"town", "lateral", "cars", 60, 2.5},
                                           {"church", "orbit", "haze", 45, 2},
                                           {"fields", "cruise", "lowsun", 70, 3}}};
  RandomNumbers random(static_cast<std::uint64_t>(seed));
  std::vector<SuiteSequence> suite;
  for (std::size_t i = 0; i < kPlans.size(); ++i) {
    const Plan& plan = kPlans[i];
    SequenceOptions options;
    SetSeeds(options, 1000 * seed + static_cast<int>(i) + 1);
    options.frames_per_s = 2.5;
    options.camera.width = 384;
    options.camera.height = 224;
    options.scene.kind = plan.scene;
    options.flight.kind = plan.flight;
    options.flight.height_m = plan.height_m;
    options.flight.radius_m = plan.height_m;
    options.flight.speed_m_per_s = plan.speed_m_per_s;
    options.flight.pitch_deg = 50;
    options.flight.duration_s = 39.01 / options.frames_per_s;
    options.flight.ramp_s = 0.5;
    options.flight.start_deg = random.Uniform(0, 360);
    options.flight.unsteadiness.position_m = 0.1;
    options.flight.unsteadiness.rotation_deg = 0.2;
    AddFeature(options, plan.feature);
    suite.push_back(
        {.name = Name("quick", i + 1, options, plan.feature), .options = options, .video = {}});
  }
  return suite;
}

}  // namespace

std::vector<SuiteSequence> BuildSuite(const std::string& name, int seed) {
  if (name == "paper51") return BuildPaper51(seed);
  if (name == "quick") return BuildQuick(seed);
  if (name == "cameras") return BuildCameras(seed);
  RequireOneOf("suite", name, kSuites);
  throw Error("a suite without sequences: " + name);
}

FlightStatistics PaperFlights() {
  return {.height_m = {71.10, 30.88, 23.00, 134.00},
          .angular_velocity_rad_per_s = {0.0156, 0.0114, 0.0000, 0.0935},
          .speed_m_per_s = {1.38, 0.67, 0.00, 4.77},
          .frames_per_s = {2.33, 0.47, 0.22, 3.98}};
}

FlightSamples PlanFlights(const std::vector<SuiteSequence>& suite) {
  FlightSamples samples;
  for (const SuiteSequence& sequence : suite) {
    const FrameTrack track = PlanFrames(sequence.options);
    samples.Append(SampleFlight(track.timestamps_s, track.T_world_cam, 0));
  }
  return samples;
}

}  // namespace mono3d::synthetic
