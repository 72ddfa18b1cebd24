// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What mono3d-bench says of positions: its draws, its bound, its comparison, and a small run.

#include "bench/position_bench.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/geo/position_file.h"
#include "mono3d/geometry/similarity.h"
#include "tools/command.h"

namespace mono3d::tools {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr Geodetic kOrigin = {49.01, 8.41, 115};

// Rows of 200 m, joined by half circles, 8 m/s, two poses a second.
Vector3d Rows(double time_s) {
  constexpr double kRow_m = 200;
  constexpr double kRadius_m = 20;
  constexpr double kTurn_m = std::numbers::pi * kRadius_m;
  const double way_m = 8 * time_s;
  const double row = std::floor(way_m / (kRow_m + kTurn_m));
  const double along_m = way_m - row * (kRow_m + kTurn_m);
  const double angle = std::max(0.0, along_m - kRow_m) / kRadius_m;
  const double x = std::min(along_m, kRow_m) + kRadius_m * std::sin(angle);
  const double y = 2 * kRadius_m * row + kRadius_m * (1 - std::cos(angle));
  return {std::fmod(row, 2) == 0 ? x : kRow_m - x, y, 60 + 5 * std::sin(time_s / 11)};
}

std::vector<StampedPose> Fly(double duration_s, const std::function<Vector3d(double)>& place_at) {
  std::vector<StampedPose> path;
  for (double time_s = 0; time_s <= duration_s; time_s += 0.5) {
    path.push_back({time_s, Pose(Eigen::Quaterniond::Identity(), place_at(time_s))});
  }
  return path;
}

TEST(PositionDraw, FollowsATurnBetweenThePoses) {
  const std::vector<StampedPose> path = Fly(100, Rows);
  for (const double time_s : {26.3, 27.7, 28.2}) {  // in a turn: a chord would be 10 cm off
    EXPECT_LT((PathAt(path, time_s).p_m - Rows(time_s)).norm(), 0.01) << time_s;
    const Vector3d velocity = (Rows(time_s + 1e-4) - Rows(time_s - 1e-4)) / 2e-4;
    EXPECT_LT((PathAt(path, time_s).velocity_m_per_s - velocity).norm(), 0.1) << time_s;
  }
  EXPECT_EQ(PathAt(path, -1).p_m, Rows(0));
}

TEST(PositionDraw, ErrsAsItIsTold) {
  const std::vector<StampedPose> path = Fly(250, Rows);
  const ReceiverKind kind{"", 2, {3, 10, 1}, false};
  double sum = 0;
  double sum_next = 0;
  double num = 0;
  double num_outliers = 0;
  double num_fixes = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const DrawnPositions drawn = DrawPositions(path, kOrigin, kind, {0.02, 30, 2}, seed);
    EXPECT_LE(std::abs(drawn.clock_offset_s), 2);
    for (std::size_t i = 0; i < drawn.errors_m.size(); ++i) {
      const PositionFix& fix = drawn.track.fixes[i];
      const Vector3d place = ToEnu({fix.latitude_deg, fix.longitude_deg, *fix.altitude_m}, kOrigin);
      const Vector3d expected = PathAt(path, drawn.true_times_s[i]).p_m + drawn.errors_m[i];
      ASSERT_LT((place - expected).norm(), 1e-6);
      ASSERT_NEAR(fix.time_s + drawn.clock_offset_s, drawn.true_times_s[i], 1e-9);
      ++num_fixes;
      num_outliers += drawn.is_outlier[i];
      if (i == 0 || drawn.is_outlier[i] != 0 || drawn.is_outlier[i - 1] != 0) continue;
      sum += drawn.errors_m[i].squaredNorm();
      sum_next += drawn.errors_m[i].dot(drawn.errors_m[i - 1]);
      num += 3;
    }
  }
  // 200 flights of 25 correlation times and three axes: the variance of the wandering part is known
  // to 2 %, and three times that is allowed.
  EXPECT_NEAR(sum / num, 9 + 1, 0.06 * 10);
  EXPECT_NEAR(sum_next / num, 9 * std::exp(-0.5 / 10), 0.06 * 9);
  EXPECT_NEAR(num_outliers / num_fixes, 0.02, 4 * std::sqrt(0.02 / num_fixes));
}

TEST(PositionDraw, IsReadBackFromItsTable) {
  const auto file = std::filesystem::path(testing::TempDir()) / "mono3d_position_table.csv";
  const std::vector<StampedPose> path = Fly(60, Rows);
  const DrawnPositions drawn = DrawPositions(path, kOrigin, ReceiverKindOf("rtk"), {}, 7);
  WritePositionTable(file, drawn.track);
  const PositionTrack track = ReadPositionFile(file);
  EXPECT_EQ(track.clock, PositionClock::kVideo);
  ASSERT_EQ(track.fixes.size(), drawn.track.fixes.size());
  for (std::size_t i = 0; i < track.fixes.size(); ++i) {
    const PositionFix& read = track.fixes[i];
    const PositionFix& fix = drawn.track.fixes[i];
    EXPECT_NEAR(read.time_s, fix.time_s, 1e-6);
    EXPECT_NEAR(read.latitude_deg, fix.latitude_deg, 1e-9);  // a tenth of a millimetre
    EXPECT_NEAR(read.longitude_deg, fix.longitude_deg, 1e-9);
    EXPECT_NEAR(*read.altitude_m, *fix.altitude_m, 1e-3);
    EXPECT_DOUBLE_EQ(read.sigma_horizontal_m, 0.03);
    EXPECT_DOUBLE_EQ(read.sigma_vertical_m, 0.03);
  }
}

// Two poses that stand still but for a step along x: the place is the mean, the scale that of the
// distance, by hand.
TEST(PlacementBound, IsWhatLeastSquaresGivesByHand) {
  std::vector<StampedPose> path;
  for (int i = 0; i < 400; ++i) {
    const double side = i < 200 ? -10 : 10;
    path.push_back({0.1 * i, Pose(Eigen::Quaterniond::Identity(), Vector3d(side, 0, 50))});
  }
  const ReceiverKind kind{"", 10, {0, 0, 2}, false};
  const DrawnPositions drawn = DrawPositions(path, kOrigin, kind, {0, 0, 0.001}, 1);
  // The offset is known; so the one step in between tells nothing.
  const PlacementBound bound(path, drawn, kind.noise, {0.01, 1e-9});
  const PlacementVector sigma = bound.covariance().diagonal().cwiseSqrt();
  const auto num = static_cast<double>(drawn.errors_m.size());
  // One fix falls into the step, and half a fix more lies on one side: a hundredth.
  EXPECT_NEAR(sigma[0], 2 / std::sqrt(num), 0.01 * sigma[0]);
  EXPECT_NEAR(sigma[6], 2 / (10 * std::sqrt(num)), 0.01 * sigma[6]);
  EXPECT_NEAR(sigma[5], 2 / (10 * std::sqrt(num)), 0.01 * sigma[5]);
  EXPECT_NEAR(sigma[3], 0.01, 1e-4);  // about the line: what is known beforehand
}

// The best estimate errs as the bound says, whichever the errors of the positions are.
TEST(PlacementBound, IsWhatManyDrawsGive) {
  const std::vector<StampedPose> path = Fly(120, Rows);
  const ReceiverKind kind{"", 1, {3, 60, 0.5}, false};
  constexpr int kNumDraws = 400;
  PlacementVector squares = PlacementVector::Zero();
  for (std::uint64_t seed = 1; seed <= kNumDraws; ++seed) {
    const DrawnPositions drawn = DrawPositions(path, kOrigin, kind, {0.02, 30, 2}, seed);
    const PlacementBound bound(path, drawn, kind.noise, {0.1, 2 / std::sqrt(3.0)});
    squares +=
        bound.error_of_best().cwiseAbs2().cwiseQuotient(bound.covariance().diagonal()) / kNumDraws;
  }
  // A mean of 400 squares is known to 7 %: three times that.
  for (const int part : {0, 1, 2, 5, 6, 7}) EXPECT_NEAR(squares[part], 1, 0.21) << part;
  EXPECT_LT(squares[3], 1);  // that up was off was not drawn
}

TEST(PlacedPath, IsOffByWhatItWasMovedBy) {
  const std::vector<StampedPose> truth = Fly(120, Rows);
  Vector3d middle = Vector3d::Zero();
  for (const StampedPose& pose : truth) middle += pose.T_world_cam.translation();
  middle /= static_cast<double>(truth.size());
  const Vector3d shift(1, -2, 0.5);
  const Similarity about(1.01, Pose(RotationExp(Vector3d(0, 0, 0.02)), Vector3d::Zero()));
  std::vector<StampedPose> placed = truth;
  for (StampedPose& pose : placed) {
    const Vector3d p = about * (pose.T_world_cam.translation() - middle) + middle + shift;
    pose.T_world_cam = Pose(pose.T_world_cam.rotation(), p);
  }
  const PlacedPathError error = ComparePlacedPath(placed, truth, 100);
  EXPECT_NEAR(error.log_scale, std::log(1.01), 1e-9);
  EXPECT_NEAR(error.heading_rad, 0.02, 1e-9);
  EXPECT_LT((error.middle_m - shift).norm(), 1e-9);
  EXPECT_LT(error.largest_m, 1e-6);
  EXPECT_LT(error.local_m, 1e-6);
  EXPECT_NEAR(error.length_m, 8 * 120, 5);  // chords
}

TEST(PlacedPath, TellsShortWavesFromLongOnes) {
  const auto line = [](double time_s) { return Vector3d(8 * time_s, 0, 60); };
  const std::vector<StampedPose> truth = Fly(250, line);
  const auto with_wave = [&](double length_m) {
    return Fly(250, [&](double time_s) {
      const Vector3d p = line(time_s);
      return Vector3d(p + Vector3d(0, std::sin(2 * std::numbers::pi * p.x() / length_m), 0));
    });
  };
  const PlacedPathError of_long = ComparePlacedPath(with_wave(4000), truth, 100);
  const PlacedPathError of_short = ComparePlacedPath(with_wave(25), truth, 100);
  EXPECT_NEAR(of_short.local_m, std::sqrt(0.5), 0.05);
  EXPECT_LT(of_long.local_m, 0.01);
  EXPECT_GT(of_long.largest_m, 0.3);
  EXPECT_THROW(ComparePlacedPath({}, truth, 100), Error);
}

PositionRun MadeUpRun(double error, double sigma, double bound) {
  PositionRun run;
  run.receiver = "made up";
  run.followed.error.setConstant(error);
  run.followed.sigma.setConstant(sigma);
  run.bound.setConstant(bound);
  run.error_of_best.setConstant(bound);
  run.followed.path.local_m = 0.02;
  run.rigid.path.local_m = 0.01;
  run.followed.path.length_m = run.rigid.path.length_m = 1000;
  run.followed.path.largest_m = 1;
  run.rigid.path.largest_m = 5;
  return run;
}

TEST(PlacementSummary, CountsWhatWasPlaced) {
  PositionRun failed = MadeUpRun(100, 1, 1);
  failed.followed.reason = "not this one";
  const PlacementSummary summary =
      Summarise({MadeUpRun(0.03, 0.04, 0.03), MadeUpRun(-0.12, 0.04, 0.06), failed});
  EXPECT_EQ(summary.num_runs, 3);
  EXPECT_EQ(summary.num_placed, 2);
  EXPECT_NEAR(summary.scale.rms_error, std::sqrt((0.0009 + 0.0144) / 2), 1e-12);
  EXPECT_NEAR(summary.scale.over_bound, std::sqrt((1 + 4) / 2.0), 1e-12);
  EXPECT_NEAR(summary.scale.over_bound_of_best, 1, 1e-12);
  EXPECT_EQ(summary.place.num, 4);
  EXPECT_EQ(summary.place.num_within_sigma, 2);
  EXPECT_DOUBLE_EQ(summary.share_within_50_ms, 0.5);
  EXPECT_NEAR(summary.median_clock_s, 0.075, 1e-12);
  EXPECT_EQ(summary.num_local_worse, 2);
  EXPECT_DOUBLE_EQ(summary.largest_share, 0.001);
  EXPECT_DOUBLE_EQ(summary.largest_alone_share, 0.005);
}

TEST(PositionBench, PlacesAFlight) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_position_bench";
  std::filesystem::remove_all(folder);
  PositionBenchOptions options;
  options.sequences = {MONO3D_EXAMPLE};
  options.output = folder.string();
  options.kinds = {"rtk"};
  options.num_draws = 1;
  options.draw.max_clock_offset_s = 0.5;
  std::filesystem::create_directories(folder);
  const std::vector<PositionRun> runs = BenchPositions(options, [](const PositionRun&) {});
  ASSERT_EQ(runs.size(), 1U);
  const PositionRun& run = runs.front();
  ASSERT_TRUE(run.followed.is_placed()) << run.followed.reason;
  ASSERT_TRUE(run.true_path.is_placed()) << run.true_path.reason;
  // A dozen fixes of 2.5 s: whether outliers are told apart is chance, and where along the circle
  // it is hangs on the clock.
  constexpr double kFar = 15;
  for (const int part : {0, 1, 2, 5, 6, 7}) {
    EXPECT_LT(std::abs(run.followed.error[part]), kFar * run.bound[part]) << part;
    EXPECT_LT(std::abs(run.true_path.error[part]), kFar * run.bound[part]) << part;
  }
  EXPECT_DOUBLE_EQ(run.share_tracked, 1);
  EXPECT_GT(run.bound[6], 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "village_orbit_rtk_1.csv"));
  std::string text;
  for (const Table& table : ToTables(runs)) text += ToText(table);
  EXPECT_THAT(text, HasSubstr("Placed by positions of 5 Hz, 3 cm"));
  EXPECT_EQ(ToJson(runs)["runs"].size(), 1U);
}

TEST(PositionBench, RefusesKindsThatItDoesNotKnow) {
  const CommandResult run =
      RunCommand(std::string(MONO3D_BENCH_TOOL) + " positions somewhere --kinds wander,sextant",
                 std::filesystem::path(testing::TempDir()));
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.errors, HasSubstr("sextant"));
}

}  // namespace
}  // namespace mono3d::tools
