// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/two_view_start.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "mono3d/core/statistics.h"
#include "tracking/start/map_initialiser.h"
#include "tracking/start/motion_selection.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::HasSubstr;

constexpr double kNoise_px = 0.3;
constexpr double kStretch_px = 2.5;  // of a wrong lens, at the border
// 0.3 px of 345 over 200 points and 10 % of baseline.
constexpr double kMaxRotationErrorDeg = 0.5;
constexpr double kMaxDirectionErrorDeg = 5;

Pose Motion(double share) {
  return {RotationExp(share * Eigen::Vector3d(0.01, -0.06, 0.02)),
          share * Eigen::Vector3d(-1.0, 0.1, 0.3)};
}

// Views of 200 points at depths around 10, or on a plane, from poses along one motion.
std::vector<View> MakeViews(bool planar, const std::vector<Pose>& poses, std::mt19937& random) {
  const CameraModel camera = SmallCamera();
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.5, 1).normalized();
  std::vector<std::vector<Eigen::Vector2d>> pixels(poses.size());
  while (pixels[0].size() < 200) {
    const Eigen::Vector2d pixel(Uniform(random, 40, 340), Uniform(random, 30, 190));
    const Eigen::Vector3d ray = camera.Unproject(pixel);
    const double depth = planar ? 9 / normal.dot(ray) : Uniform(random, 6, 15);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Vector2d noise(Normal(random, kNoise_px), Normal(random, kNoise_px));
      pixels[i].push_back(camera.Project(poses[i] * (depth * ray)) + noise);
    }
  }
  std::vector<View> views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    views.push_back(MakeView(camera, pixels[i]));
    views.back().frame.index = static_cast<std::int64_t>(i);
    views.back().frame.timestamp_s = 0.1 * static_cast<double>(i);
  }
  return views;
}

// The same numbers match; the first `num_wrong` are turned round among themselves.
std::vector<FeatureMatch> MatchAll(std::size_t num_wrong = 0) {
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < 200; ++i)
    matches.push_back({i, i < num_wrong ? num_wrong - 1 - i : i});
  return matches;
}

StartAttempt Start(const std::vector<View>& views, const std::vector<FeatureMatch>& matches) {
  return StartFromTwoViews(views.front(), views.back(), matches, SmallCamera(), {}, 1);
}

struct PoseError {
  double rotation_deg = 0;
  double direction_deg = 0;  // of the translation
};

PoseError ErrorOf(const Pose& found, const Pose& truth) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double cosine = found.translation().normalized().dot(truth.translation().normalized());
  return {(found.Inverse() * truth).RotationAngle() * kDegrees,
          std::acos(std::min(1.0, cosine)) * kDegrees};
}

void ExpectMotion(const Pose& found, const Pose& truth) {
  const PoseError error = ErrorOf(found, truth);
  EXPECT_LT(error.rotation_deg, kMaxRotationErrorDeg);
  EXPECT_LT(error.direction_deg, kMaxDirectionErrorDeg);
}

TEST(StartFromTwoViews, RecoversTheMotionOverReliefWithWrongMatches) {
  std::mt19937 random(SeedFromTestName());
  const auto views = MakeViews(false, {Pose(), Motion(1)}, random);
  const StartAttempt attempt = Start(views, MatchAll(40));
  ASSERT_EQ(attempt.candidates.size(), 1U) << attempt.reason;
  EXPECT_FALSE(attempt.candidates[0].is_planar);
  ExpectMotion(attempt.candidates[0].T_b_a, Motion(1));
  EXPECT_GE(attempt.candidates[0].p_a.size(), 140U);
  EXPECT_EQ(attempt.candidates[0].p_a.size(), attempt.candidates[0].matches.size());
}

// A way of a thousandth of the depth moves the points by half a pixel, most of it as a turn does;
// the noise of two pixels is as much.
TEST(StartFromTwoViews, HasNoMotionWhereATurnOnTheSpotExplainsTheViewsAsWell) {
  std::mt19937 random(SeedFromTestName());
  InitialisationOptions options;
  options.min_parallax_deg = 0.02;  // which they have
  const auto views = MakeViews(true, {Pose(), Motion(0.01)}, random);
  const StartAttempt attempt =
      StartFromTwoViews(views[0], views[1], MatchAll(), SmallCamera(), options, 1);
  EXPECT_TRUE(attempt.candidates.empty());
  EXPECT_THAT(attempt.reason, HasSubstr("a turn on the spot explains the views as well"));
}

TEST(StartFromTwoViews, TellsWhereATurnOnTheSpotExplainsTheViewsNearlyAsWell) {
  std::mt19937 random(SeedFromTestName());
  InitialisationOptions options;
  options.min_parallax_deg = 0.5;
  for (const auto& [share, is_near] : {std::pair(0.14, true), std::pair(1., false)}) {
    const auto views = MakeViews(true, {Pose(), Motion(share)}, random);
    const StartAttempt attempt =
        StartFromTwoViews(views[0], views[1], MatchAll(), SmallCamera(), options, 1);
    EXPECT_FALSE(attempt.candidates.empty()) << share << ": " << attempt.reason;
    EXPECT_EQ(attempt.is_near_turn, is_near) << share;
  }
}

TEST(StartFromTwoViews, HoldsTheMotionOverAPlaneAmongItsCandidates) {
  std::mt19937 random(SeedFromTestName());
  const auto views = MakeViews(true, {Pose(), Motion(1)}, random);
  const StartAttempt attempt = Start(views, MatchAll(40));
  ASSERT_GE(attempt.candidates.size(), 1U) << attempt.reason;
  EXPECT_TRUE(attempt.candidates[0].is_planar);
  double smallest = 10;
  for (const TwoViewStart& start : attempt.candidates) {
    const Pose error = start.T_b_a * Motion(1).Inverse();
    smallest = std::min(smallest, error.RotationAngle());
  }
  EXPECT_LT(smallest * 180 / std::numbers::pi, kMaxRotationErrorDeg);
}

TEST(StartFromTwoViews, SaysWhyItDoesNotStart) {
  std::mt19937 random(SeedFromTestName());
  const auto views = MakeViews(false, {Pose(), Motion(1)}, random);
  auto few = MatchAll();
  few.resize(62);
  EXPECT_EQ(Start(views, few).reason, "62 matches, 100 needed");

  const auto turned = MakeViews(
      false, {Pose(), Pose(RotationExp({0.01, 0.05, 0}), Eigen::Vector3d::Zero())}, random);
  EXPECT_TRUE(Start(turned, MatchAll()).candidates.empty());
  EXPECT_FALSE(Start(turned, MatchAll()).reason.empty());

  const auto close = MakeViews(false, {Pose(), Motion(0.02)}, random);
  EXPECT_TRUE(Start(close, MatchAll()).candidates.empty());
}

// Views from nearly one place through a lens that is told wrongly: a turn and a shift against each
// other explain them by a parallax that is not there.
TEST(StartFromTwoViews, TakesNoParallaxFromAWrongLens) {
  std::mt19937 random(SeedFromTestName());
  const CameraModel camera = SmallCamera();
  int num_starts = 0;
  for (int i = 0; i < 60; ++i) {
    auto views = MakeViews(false, {Pose(), Motion(0.03)}, random);
    for (Feature& feature : views.back().features) {
      const Eigen::Vector2d from_centre = feature.pixel - Eigen::Vector2d(camera.cx, camera.cy);
      feature.pixel.y() += kStretch_px * std::pow(from_centre.x() / camera.cx, 2);
      feature.pixel += Eigen::Vector2d(Normal(random, 0.7), Normal(random, 0.7));
    }
    const StartAttempt attempt = Start(views, MatchAll());
    if (!attempt.candidates.empty() && !attempt.candidates[0].is_planar) ++num_starts;
  }
  EXPECT_EQ(num_starts, 0);
}

TEST(SelectMotion, TellsTheTwoMotionsOverAPlaneApartByAThirdView) {
  std::mt19937 random(SeedFromTestName());
  // The way between bends, as real flights do.
  const Pose middle(RotationExp({0.02, -0.01, 0.0}), Eigen::Vector3d(-0.5, 0.3, 0));
  // Of 300 draws of the noise 6 % lead to more than the error allowed, the worst to 0.83 degrees.
  constexpr int kNumDraws = 5;
  std::vector<float> rotation_errors_deg;
  std::vector<float> direction_errors_deg;
  for (int i = 0; i < kNumDraws; ++i) {
    const auto views = MakeViews(true, {Pose(), middle, Motion(1.5)}, random);
    StartAttempt attempt = Start(views, MatchAll());
    ASSERT_GE(attempt.candidates.size(), 1U) << attempt.reason;
    const std::vector<BetweenView> between = {{&views[1], 0.5, MatchAll()}};
    const auto chosen =
        SelectMotion(attempt.candidates, {}, views[0], views[2], between, SmallCamera());
    ASSERT_TRUE(chosen.has_value());
    const PoseError error = ErrorOf(chosen->T_b_a, Motion(1.5));
    rotation_errors_deg.push_back(static_cast<float>(error.rotation_deg));
    direction_errors_deg.push_back(static_cast<float>(error.direction_deg));
  }
  EXPECT_LT(UpperMedian(rotation_errors_deg), kMaxRotationErrorDeg);
  EXPECT_LT(UpperMedian(direction_errors_deg), kMaxDirectionErrorDeg);
}

// A motion that fits no better than a turn: the depths that it needs do not hold for the view
// between.
TEST(IsRefuted, AMotionThatOtherViewsContradict) {
  std::mt19937 random(SeedFromTestName());
  const auto views = MakeViews(true, {Pose(), Motion(0.5), Motion(1)}, random);
  const std::vector<BetweenView> between = {{&views[1], 0.5, MatchAll()}};
  const StartAttempt attempt =
      StartFromTwoViews(views[0], views[2], MatchAll(), SmallCamera(), {}, 1);
  ASSERT_FALSE(attempt.candidates.empty()) << attempt.reason;
  const auto right = std::ranges::min_element(attempt.candidates, {}, [](const auto& start) {
    return ErrorOf(start.T_b_a, Motion(1)).rotation_deg;
  });
  EXPECT_FALSE(IsRefuted(*right, views[0], views[2], between, SmallCamera()));
  // Most of the points are elsewhere in the view between, wherever it was taken.
  const std::vector<BetweenView> other = {{&views[1], 0.5, MatchAll(150)}};
  EXPECT_TRUE(IsRefuted(*right, views[0], views[2], other, SmallCamera()));
  // Two views alone cannot.
  EXPECT_FALSE(IsRefuted(*right, views[0], views[2], {}, SmallCamera()));
}

TEST(SelectMotion, TakesAnUnlikelyMotionWhereItIsClearlyBetter) {
  std::mt19937 random(SeedFromTestName());
  const Pose middle(RotationExp({0.02, -0.01, 0.0}), Eigen::Vector3d(-0.5, 0.3, 0));
  const auto views = MakeViews(true, {Pose(), middle, Motion(1.5)}, random);
  const std::vector<BetweenView> between = {{&views[1], 0.5, MatchAll()}};
  const StartAttempt attempt = Start(views, MatchAll());
  ASSERT_EQ(attempt.candidates.size(), 2U) << attempt.reason;
  const auto error_of = [](const TwoViewStart& start) {
    return ErrorOf(start.T_b_a, Motion(1.5)).rotation_deg;
  };
  std::vector<TwoViewStart> right = attempt.candidates;
  std::ranges::sort(right, {}, error_of);
  const std::vector<TwoViewStart> wrong = {right.back()};
  right.pop_back();
  const auto select = [&](const auto& candidates, const auto& unlikely) {
    return SelectMotion(candidates, unlikely, views[0], views[2], between, SmallCamera());
  };
  const auto by_unlikely = select(wrong, right);
  ASSERT_TRUE(by_unlikely.has_value());
  EXPECT_LT(error_of(*by_unlikely), kMaxRotationErrorDeg);
  const auto by_likely = select(right, wrong);
  ASSERT_TRUE(by_likely.has_value());
  EXPECT_LT(error_of(*by_likely), kMaxRotationErrorDeg);
  // The same motion twice is no rival, and where nothing can be compared the candidate stands.
  EXPECT_TRUE(select(right, right).has_value());
  EXPECT_TRUE(SelectMotion(right, wrong, views[0], views[2], {}, SmallCamera()).has_value());
}

TEST(SelectMotion, TakesTheOnlyOneAndNoneWithoutAThirdView) {
  std::mt19937 random(SeedFromTestName());
  const auto views = MakeViews(false, {Pose(), Motion(1)}, random);
  const StartAttempt attempt = Start(views, MatchAll());
  ASSERT_EQ(attempt.candidates.size(), 1U);
  EXPECT_TRUE(
      SelectMotion(attempt.candidates, {}, views[0], views[1], {}, SmallCamera()).has_value());
  const std::vector<TwoViewStart> twice = {attempt.candidates[0], attempt.candidates[0]};
  EXPECT_FALSE(SelectMotion(twice, {}, views[0], views[1], {}, SmallCamera()).has_value());
}

TEST(MapInitialiser, WaitsForParallax) {
  std::mt19937 random(SeedFromTestName());
  std::vector<Pose> poses;
  for (int i = 0; i <= 10; ++i) poses.push_back(Motion(0.05 * i));
  const auto views = MakeViews(false, poses, random);
  MapInitialiser initialiser({}, 1);
  std::optional<MapStart> start;
  std::string reason;
  for (const View& view : views) {
    if (!start) start = initialiser.Add(view, reason);
    if (!start && view.frame.index > 0) {
      EXPECT_FALSE(reason.empty());
    }
  }
  ASSERT_TRUE(start.has_value()) << reason;
  EXPECT_EQ(start->first.frame.index, 0);
  EXPECT_GT(start->second.frame.index, 1);
}

TEST(MapInitialiser, NamesTheLackOfFeatures) {
  MapInitialiser initialiser({}, 1);
  std::string reason;
  EXPECT_FALSE(initialiser.Add(MakeView(SmallCamera(), {{1, 1}}), reason).has_value());
  EXPECT_EQ(reason, "1 features, 100 needed");
}

}  // namespace
}  // namespace mono3d::tracking
