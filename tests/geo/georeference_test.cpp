// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/georeference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr Geodetic kOrigin = {49.01, 8.41, 115};
constexpr double kDegree = std::numbers::pi / 180;

// A map of which 1 unit is 37 m, turned and moved.
Similarity TrueSimilarity() {
  return {37, Pose(RotationExp(Vector3d(0.3, -1.1, 2.0)), Vector3d(120, -40, 60))};
}

// Cameras of a flight that look along the path, 10 a second.
std::vector<PositionedCamera> Fly(double duration_s,
                                  const std::function<Vector3d(double)>& p_enu_at) {
  std::vector<PositionedCamera> cameras;
  const Similarity S_map_enu = TrueSimilarity().Inverse();
  for (int i = 0; i <= std::lround(10 * duration_s); ++i) {
    const double time_s = 0.1 * i;
    const Pose T_enu_cam(RotationExp(Vector3d(-2.0, 0, 0)), p_enu_at(time_s));
    cameras.push_back({time_s, "image" + std::to_string(i), S_map_enu * T_enu_cam});
  }
  return cameras;
}

// Strips of 100 m, 8 m/s, climbing and sinking a little.
Vector3d Strips(double time_s) {
  const double along = std::fmod(8 * time_s, 240);
  const double strip = std::floor(8 * time_s / 240);
  const double x = along < 100 ? along : along < 120 ? 100 : along < 220 ? 220 - along : 0;
  const double y = along < 100 ? 0 : along < 120 ? along - 100 : along < 220 ? 20 : along - 200;
  return {x, 40 * strip + y, 50 + 4 * std::sin(time_s / 9)};
}

Vector3d Line(double time_s) { return {6 * time_s, 3 * time_s, 50}; }

struct ReceiverErrors {
  double period_s = 1;
  PositionNoise horizontal;
  PositionNoise vertical;
  double outlier_share = 0;
  double offset_s = 0;  // image time minus fix time
};

PositionTrack Receive(double duration_s, const std::function<Vector3d(double)>& p_enu_at,
                      const ReceiverErrors& errors, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  PositionTrack track;
  Vector3d wander(normal(random), normal(random), normal(random));
  const auto sigma = [&](double PositionNoise::*part) {
    return Vector3d(errors.horizontal.*part, errors.horizontal.*part, errors.vertical.*part);
  };
  for (double time_s = 0; time_s <= duration_s; time_s += errors.period_s) {
    for (int axis = 0; axis < 3; ++axis) {
      const double correlation_s =
          axis < 2 ? errors.horizontal.correlation_s : errors.vertical.correlation_s;
      const double kept = correlation_s > 0 ? std::exp(-errors.period_s / correlation_s) : 0;
      wander[axis] = kept * wander[axis] + std::sqrt(1 - kept * kept) * normal(random);
    }
    const Vector3d white(normal(random), normal(random), normal(random));
    Vector3d p = p_enu_at(time_s) + wander.cwiseProduct(sigma(&PositionNoise::wander_m)) +
                 white.cwiseProduct(sigma(&PositionNoise::white_m));
    if (uniform(random) < errors.outlier_share) p += Vector3d(70, -90, 40);
    const Geodetic place = ToGeodetic(p, kOrigin);
    PositionFix fix;
    fix.time_s = time_s - errors.offset_s;
    fix.latitude_deg = place.latitude_deg;
    fix.longitude_deg = place.longitude_deg;
    fix.altitude_m = place.altitude_m;
    track.fixes.push_back(fix);
  }
  return track;
}

// Camera centres in east, north, up of kOrigin.
Vector3d Placed(const Georeference& georeference, const Vector3d& p_map) {
  return ToEnu(ToGeodetic(georeference.S_enu_map * p_map, georeference.origin), kOrigin);
}

TEST(Georeference, IsExactWhereThePositionsAre) {
  const auto cameras = Fly(60, Strips);
  const auto result = EstimateGeoreference(cameras, Receive(60, Strips, {}, 1), std::nullopt, {});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 1e-5);
  for (const PositionedCamera& camera : cameras) {
    EXPECT_LT(
        (Placed(*result.georeference, camera.T_map_cam.translation()) - Strips(camera.timestamp_s))
            .norm(),
        0.01);
  }
  EXPECT_NEAR(result.georeference->clock_offset_s, 0, 1e-3);
  EXPECT_GE(result.georeference->num_used, 59U);  // the first and the last may fall outside
  EXPECT_TRUE(result.georeference->has_altitude);
}

// Two images a second on a circle: chords between them would lie inside it by a tenth of a per
// mille, which a receiver with corrections tells.
TEST(Georeference, DoesNotCutTurns) {
  const auto circle = [](double time_s) {
    const double angle = 0.1 * time_s;
    return Vector3d(80 * std::cos(angle), 80 * std::sin(angle), 60 + 3 * std::sin(time_s / 7));
  };
  std::vector<PositionedCamera> cameras;
  for (const PositionedCamera& camera : Fly(250, circle)) {
    const bool is_of_half = std::abs(std::remainder(camera.timestamp_s, 0.5)) < 0.01;
    if (is_of_half) cameras.push_back(camera);
  }
  const auto result =
      EstimateGeoreference(cameras, Receive(250, circle, {0.3, {}, {}, 0, 0}, 1), std::nullopt, {});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 1e-6);
}

TEST(Georeference, FindsTheClockOffsetAndLeavesOutliersOut) {
  ReceiverErrors errors{0.2, {0, 0, 1}, {0, 0, 1}, 0.02, 1.7};
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto result =
        EstimateGeoreference(Fly(60, Strips), Receive(60, Strips, errors, seed), std::nullopt, {});
    ASSERT_TRUE(result.georeference.has_value()) << result.reason;
    const Georeference& found = *result.georeference;
    EXPECT_NEAR(found.clock_offset_s, 1.7, 4 * found.clock_offset_sigma_s);
    EXPECT_LT(found.clock_offset_sigma_s, 0.05);
    EXPECT_NEAR(found.S_enu_map.scale() / 37, 1, 4 * found.scale_sigma);
    std::size_t num_outliers = 0;
    for (const PositionResidual& residual : found.residuals) {
      EXPECT_EQ(residual.is_outlier, residual.enu_m.norm() > 60);
      num_outliers += residual.is_outlier ? 1U : 0U;
    }
    EXPECT_GT(num_outliers, 0U);
    EXPECT_NEAR(found.horizontal.white_m, 1, 0.15);
  }
}

// On a straight line at an even speed an offset is told by the seconds alone in which the flight
// speeds up and slows down; those are what another offset leaves without a camera.
TEST(Georeference, FindsTheClockOffsetOfAStripFromItsEnds) {
  constexpr double kDuration_s = 250;
  const auto strip = [](double time_s) {
    constexpr double kRamp_s = 3, kSpeed = 8;
    const auto sped_up = [&](double t) {  // smoothly; the way after so long
      const double u = std::clamp(t / kRamp_s, 0.0, 1.0);
      return kSpeed * (kRamp_s * (u * u * u - u * u * u * u / 2) + std::max(t - kRamp_s, 0.0));
    };
    const double way_m = time_s < kDuration_s / 2
                             ? sped_up(time_s)
                             : 2 * sped_up(kDuration_s / 2) - sped_up(kDuration_s - time_s);
    return Vector3d(0.7 * way_m + 0.2 * std::sin(time_s / 2), 0.7 * way_m,
                    60 + 0.2 * std::sin(time_s / 3));
  };
  const auto cameras = Fly(kDuration_s, strip);
  const UpDirection up{TrueSimilarity().pose().rotation().inverse() * Vector3d::UnitZ(),
                       2 * kDegree};
  for (unsigned seed = 21; seed <= 32; ++seed) {
    const double offset_s = -2 + 0.066 * seed;
    const ReceiverErrors errors{1, {3, 60, 0}, {3, 60, 0}, 0.02, offset_s};
    const auto result =
        EstimateGeoreference(cameras, Receive(kDuration_s, strip, errors, seed), up, {});
    ASSERT_TRUE(result.georeference.has_value()) << result.reason;
    EXPECT_NEAR(result.georeference->clock_offset_s, offset_s, 0.3) << seed;
  }
}

// Of positions to centimetres, an offset is told by how the camera sways, and half a sway on they
// fit worse than a whole one.
TEST(Georeference, FindsTheClockOffsetOfACameraThatSways) {
  constexpr double kDuration_s = 250;
  const auto sway = [](double time_s, double phase) {
    double sum = 0;
    for (const double period_s : {1.3, 2.1, 4.5, 11.0}) {
      sum += 0.14 * std::sin(2 * std::numbers::pi * time_s / period_s + phase * period_s);
    }
    return sum;
  };
  const auto swaying = [&](double time_s) {
    return Vector3d(5.7 * time_s + sway(time_s, 0), 5.7 * time_s + sway(time_s, 1),
                    60 + sway(time_s, 2));
  };
  std::vector<PositionedCamera> cameras;
  for (const PositionedCamera& camera : Fly(kDuration_s, swaying)) {
    const bool is_of_third = std::abs(std::remainder(camera.timestamp_s, 0.3)) < 0.01;
    if (is_of_third) cameras.push_back(camera);
  }
  const UpDirection up{TrueSimilarity().pose().rotation().inverse() * Vector3d::UnitZ(),
                       2 * kDegree};
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const double offset_s = -1.1 + 0.17 * seed;
    PositionTrack track =
        Receive(kDuration_s, swaying, {0.2, {0, 0, 0.03}, {0, 0, 0.03}, 0.02, offset_s}, seed);
    for (PositionFix& fix : track.fixes) fix.sigma_horizontal_m = fix.sigma_vertical_m = 0.03;
    const auto result = EstimateGeoreference(cameras, track, up, {});
    ASSERT_TRUE(result.georeference.has_value()) << result.reason;
    EXPECT_NEAR(result.georeference->clock_offset_s, offset_s,
                5 * result.georeference->clock_offset_sigma_s)
        << seed;
    EXPECT_LT(result.georeference->clock_offset_sigma_s, 0.01);
  }
}

// Errors of 3 m that wander over a minute, as long as the flight itself.
TEST(Georeference, StatesHowSureItIs) {
  const ReceiverErrors errors{1, {3, 60, 0}, {3, 60, 0}, 0.02, 0};
  const auto cameras = Fly(120, Strips);
  constexpr int kNumFlights = 60;
  int num_within = 0;
  int num_all = 0;
  double sum_squares = 0;
  for (unsigned seed = 1; seed <= kNumFlights; ++seed) {
    const auto result = EstimateGeoreference(cameras, Receive(120, Strips, errors, seed),
                                             std::nullopt, {.clock_offset_sigma_s = 0.5});
    ASSERT_TRUE(result.georeference.has_value()) << result.reason;
    const Georeference& found = *result.georeference;
    const Similarity error = found.S_enu_map * TrueSimilarity().Inverse();
    const Vector3d omega = RotationLog(error.pose().rotation());
    for (const double z :
         {std::log(error.scale()) / found.scale_sigma, omega.z() / found.heading_sigma_rad}) {
      ++num_all;
      num_within += std::abs(z) < 1 ? 1 : 0;
      sum_squares += z * z;
    }
  }
  // 120 numbers that are not quite independent: 68 % +- 3 standard deviations.
  EXPECT_NEAR(num_within, 0.68 * num_all, 3 * std::sqrt(0.68 * 0.32 * num_all));
  EXPECT_NEAR(std::sqrt(sum_squares / num_all), 1, 0.3);
}

// A line tells nothing about the roll around it.
TEST(Georeference, TakesTheRollAboutALineFromUp) {
  const auto cameras = Fly(60, Line);
  const PositionTrack track = Receive(60, Line, {1, {0, 0, 0.5}, {0, 0, 0.5}, 0, 0}, 3);
  const GeoreferenceOptions options = {.clock_offset_sigma_s = 0};
  const auto without = EstimateGeoreference(cameras, track, std::nullopt, options);
  EXPECT_FALSE(without.georeference.has_value());
  EXPECT_FALSE(without.reason.empty());

  const UpDirection up{TrueSimilarity().pose().rotation().inverse() * Vector3d::UnitZ(),
                       2 * kDegree};
  const auto with = EstimateGeoreference(cameras, track, up, options);
  ASSERT_TRUE(with.georeference.has_value()) << with.reason;
  const Vector3d up_found = with.georeference->S_enu_map.pose().rotation() * up.up_map;
  EXPECT_LT(std::acos(up_found.z()), 0.5 * kDegree);
  EXPECT_NEAR(with.georeference->tilt_sigma_rad, 2 * kDegree, 0.8 * kDegree);
}

TEST(Georeference, DoesNotBelieveAReceiverThatIsFrozen) {
  PositionTrack track = Receive(60, Strips, {1, {0, 0, 0.3}, {0, 0, 0.3}, 0, 0}, 5);
  for (std::size_t i = 21; i < 28; ++i) {
    track.fixes[i].latitude_deg = track.fixes[20].latitude_deg;
    track.fixes[i].longitude_deg = track.fixes[20].longitude_deg;
  }
  const auto result = EstimateGeoreference(Fly(60, Strips), track, std::nullopt, {});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 4 * result.georeference->scale_sigma);
  for (const PositionResidual& residual : result.georeference->residuals) {
    EXPECT_EQ(residual.is_outlier, residual.fix > 20 && residual.fix < 28) << residual.fix;
  }
}

TEST(Georeference, GoesByTheNamesOfImages) {
  PositionTrack track = Receive(60, Strips, {1, {0, 0, 0.5}, {0, 0, 0.5}, 0, 0}, 7);
  track.clock = PositionClock::kImages;
  for (std::size_t i = 0; i < track.fixes.size(); ++i) {
    track.fixes[i].image = "image" + std::to_string(10 * i);
    track.fixes[i].time_s = 0;
  }
  const auto result = EstimateGeoreference(Fly(60, Strips), track, std::nullopt, {});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 4 * result.georeference->scale_sigma);
  EXPECT_EQ(result.georeference->clock_offset_sigma_s, 0);

  track.fixes.resize(5);
  for (PositionFix& fix : track.fixes) fix.image = "other";
  const auto none = EstimateGeoreference(Fly(60, Strips), track, std::nullopt, {});
  EXPECT_THAT(none.reason, HasSubstr("by their name"));
}

// Errors of minutes are shared by photographs of seconds, and not by those of hours.
TEST(Georeference, KnowsWhenPhotographsWereTaken) {
  const auto take = [](double seconds_between) {
    PositionTrack track = Receive(30, Strips, {1, {0, 0, 0.5}, {0, 0, 0.5}, 0, 0}, 7);
    track.clock = PositionClock::kImages;
    track.has_image_times = true;
    constexpr double kFirst_s = 1.5e9;
    // Their names run backwards.
    for (std::size_t i = 0; i < track.fixes.size(); ++i) {
      track.fixes[i].image = "image" + std::to_string(10 * i);
      track.fixes[i].time_s =
          kFirst_s + seconds_between * static_cast<double>(track.fixes.size() - 1 - i);
    }
    return EstimateGeoreference(Fly(30, Strips), track, std::nullopt, {});
  };
  const GeoreferenceResult seconds = take(0.5), hours = take(3600);
  ASSERT_TRUE(seconds.georeference && hours.georeference) << seconds.reason << hours.reason;
  EXPECT_LT(hours.georeference->position_sigma_m.norm(),
            0.5 * seconds.georeference->position_sigma_m.norm());
  const std::vector<PositionResidual>& residuals = seconds.georeference->residuals;
  ASSERT_EQ(residuals.size(), 31U);
  EXPECT_EQ(residuals.front().image, "image300");
  EXPECT_EQ(residuals.front().time_s, 0);
  EXPECT_EQ(residuals.front().taken_s, 1.5e9);
  EXPECT_EQ(residuals.back().image, "image0");
  EXPECT_EQ(residuals.back().time_s, 15);
}

// Times are those of the images, whatever was told of them; frames go by their index.
TEST(Georeference, TellsTheFramesOfPositionsByName) {
  PositionTrack track = Receive(60, Strips, {}, 7);
  track.clock = PositionClock::kImages;
  track.has_image_times = true;
  std::vector<PositionedCamera> cameras = Fly(60, Strips);
  for (std::size_t i = 0; i < cameras.size(); ++i) cameras[i].timestamp_s = static_cast<double>(i);
  for (std::size_t i = 0; i < track.fixes.size(); ++i) {
    track.fixes[i].image = "image" + std::to_string(10 * i);
    track.fixes[i].time_s = 1.5e9 + 7 * static_cast<double>(i);
  }
  const auto result = EstimateGeoreference(cameras, track, std::nullopt, {});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  const CameraPositions told = CameraPositionsOf(cameras, track, *result.georeference, {});
  ASSERT_EQ(told.positions.size(), track.fixes.size());
  for (std::size_t i = 0; i < told.positions.size(); ++i) {
    EXPECT_EQ(told.positions[i].frame_index, static_cast<std::int64_t>(10 * i));
  }
}

// A recorder that knows the time of day, and began before the camera.
TEST(Georeference, FindsThePlaceInALongerTrackOfAnotherClock) {
  const auto path = [](double time_s) { return Strips(time_s - 40); };
  PositionTrack track = Receive(
      120, [&](double t) { return t < 40 ? Vector3d(t, 0, 0) : path(t); },
      {1, {0, 0, 0.5}, {0, 0, 0.5}, 0, 0}, 9);
  track.clock = PositionClock::kUnix;
  for (PositionFix& fix : track.fixes) fix.time_s += 1.7e9;
  const auto result = EstimateGeoreference(Fly(60, Strips), track, std::nullopt, {});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_NEAR(result.georeference->clock_offset_s, -1.7e9 - 40, 0.5);
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 0.05);
}

TEST(Georeference, NeedsAFlightThatIsLongAgainstTheErrors) {
  const auto creep = [](double time_s) { return Vector3d(0.05 * Strips(time_s)); };
  const auto result = EstimateGeoreference(
      Fly(60, creep), Receive(60, creep, {1, {2, 30, 0}, {2, 30, 0}, 0, 0}, 11), std::nullopt, {});
  EXPECT_FALSE(result.georeference.has_value());
  EXPECT_FALSE(result.reason.empty());
}

TEST(Georeference, KnowsTheAntennaFromTheCamera) {
  const GeoreferenceOptions options = {
      .antenna_right_m = 1, .antenna_down_m = -3, .antenna_forward_m = 0.5};
  const Eigen::Quaterniond R_enu_cam = RotationExp(Vector3d(-2.0, 0, 0));
  const auto antenna = [&](double time_s) {
    return Vector3d(Strips(time_s) + R_enu_cam * Vector3d(1, -3, 0.5));
  };
  const auto cameras = Fly(60, Strips);
  const auto result =
      EstimateGeoreference(cameras, Receive(60, antenna, {}, 1), std::nullopt, options);
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_LT((Placed(*result.georeference, cameras[0].T_map_cam.translation()) - Strips(0)).norm(),
            0.05);
}

TEST(Georeference, RefusesOptionsOutOfRange) {
  const GeoreferenceOptions options = {.clock_offset_sigma_s = -1};
  EXPECT_THROW(EstimateGeoreference({}, {}, std::nullopt, options), UsageError);
}

// Straight ahead and level: up is against y. Straight down: up is against the line of sight.
TEST(Georeference, TakesUpFromTheGimbal) {
  std::vector<PositionedCamera> cameras;
  PositionTrack track;
  track.clock = PositionClock::kImages;
  for (int i = 0; i < 4; ++i) {
    PositionFix fix;
    fix.latitude_deg = 49 + 1e-4 * i;
    fix.longitude_deg = 8;
    fix.image = std::to_string(i);
    fix.gimbal = GimbalAngles{77, -90, 0};
    track.fixes.push_back(fix);
    cameras.push_back({1.0 * i, fix.image, Pose()});
  }
  EXPECT_LT((UpFromGimbal(cameras, track)->up_map - Vector3d(0, 0, -1)).norm(), 1e-9);
  for (PositionFix& fix : track.fixes) fix.gimbal->pitch_deg = 0;
  EXPECT_LT((UpFromGimbal(cameras, track)->up_map - Vector3d(0, -1, 0)).norm(), 1e-9);
  // Clockwise, as seen from behind: the right side of the image goes down, up goes to the left.
  for (PositionFix& fix : track.fixes) fix.gimbal->roll_deg = 90;
  EXPECT_LT((UpFromGimbal(cameras, track)->up_map - Vector3d(-1, 0, 0)).norm(), 1e-9);
  for (PositionFix& fix : track.fixes) fix.gimbal.reset();
  EXPECT_FALSE(UpFromGimbal(cameras, track).has_value());
}

}  // namespace
}  // namespace mono3d
