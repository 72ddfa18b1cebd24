// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Starts over a plane, where two motions explain two views equally well. A straight flight at a
// fixed attitude is the hard case: the wrong motion keeps almost the same plane over all views.

#include "tracking/start/motion_selection.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <string>

#include "mono3d/tracking/tracker.h"
#include "tracking/start/map_initialiser.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kDegreesOfSelection = 180 / std::numbers::pi;
// The two motions of these flights are 3 degrees apart and more.
constexpr double kMaxSelectedRotationErrorDeg = 1;
constexpr double kMaxSelectedDirectionErrorDeg = 15;

// What the alignment of patches leaves.
constexpr double kSelectionNoise_px = 0.05;

struct Direction {
  const char* name;
  Eigen::Vector3d in_camera;
};
// Seen from a camera that looks obliquely down on the plane.
const std::vector<Direction>& Directions() {
  static const std::vector<Direction> directions = {
      {"sideways", {1, 0, 0}},    {"ahead", {0, -0.55, 0.84}},      {"along the axis", {0, 0, 1}},
      {"back", {0, 0.55, -0.84}}, {"oblique", {-0.7, -0.3, 0.648}}, {"up", {0, -0.84, -0.55}}};
  return directions;
}

// Views of 200 points of a plane from a straight flight, 0.8 degrees of parallax apart.
std::vector<View> StraightFlight(const Eigen::Vector3d& direction, int num_views, double noise_px,
                                 std::mt19937& random) {
  const CameraModel camera = SmallCamera();
  const Eigen::Vector3d normal(0, 0.84, 0.55);
  std::vector<std::vector<Eigen::Vector2d>> pixels(static_cast<std::size_t>(num_views));
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d pixel(Uniform(random, 60, 320), Uniform(random, 50, 170));
    const Eigen::Vector3d ray = camera.Unproject(pixel);
    const Eigen::Vector3d p_a = 6 / normal.dot(ray) * ray;
    for (int view = 0; view < num_views; ++view) {
      const Eigen::Vector2d noise(Normal(random, noise_px), Normal(random, noise_px));
      pixels[static_cast<std::size_t>(view)].push_back(
          camera.Project(p_a - 0.15 * view * direction) + noise);
    }
  }
  std::vector<View> views;
  for (int view = 0; view < num_views; ++view) {
    views.push_back(MakeView(camera, pixels[static_cast<std::size_t>(view)]));
    views.back().frame.index = view;
    views.back().frame.timestamp_s = 0.1 * view;
  }
  return views;
}

TEST(SelectMotion, TakesNoWrongMotionOverAPlaneOnStraightFlights) {
  std::mt19937 random(SeedFromTestName());
  constexpr int kNumSeeds = 3;
  constexpr int kNumViews = 14;
  for (const Direction& direction : Directions()) {
    int num_started = 0;
    for (int seed = 0; seed < kNumSeeds; ++seed) {
      const auto views = StraightFlight(direction.in_camera, kNumViews, kSelectionNoise_px, random);
      MapInitialiser initialiser({}, seed);
      std::optional<MapStart> start;
      std::string reason;
      for (const View& view : views) {
        start = initialiser.Add(view, reason);
        if (start) break;
      }
      if (!start) continue;
      ++num_started;
      const Pose& found = start->motion.T_b_a;
      EXPECT_LT(found.RotationAngle() * kDegreesOfSelection, kMaxSelectedRotationErrorDeg)
          << direction.name;
      EXPECT_GT(-found.translation().normalized().dot(direction.in_camera.normalized()),
                std::cos(kMaxSelectedDirectionErrorDeg / kDegreesOfSelection))
          << direction.name;
    }
    EXPECT_GE(num_started, kNumSeeds - 1) << direction.name;
  }
}

TEST(SelectMotion, DecidesNothingWhereNoiseHidesTheDifference) {
  std::mt19937 random(SeedFromTestName());
  // Three views 0.03 % of the distance apart: what tells the motions apart is far below the noise.
  const auto views = StraightFlight({0.003, 0, 0}, 3, 0.5, random);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < 200; ++i) matches.push_back({i, i});
  // Two motions that differ in nothing but the noise of their points.
  TwoViewStart one;
  one.T_b_a = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.1, 0, 0));
  one.matches = matches;
  for (const Feature& feature : views[0].features) {
    one.p_a.push_back(Uniform(random, 9, 11) * SmallCamera().Unproject(feature.pixel));
  }
  TwoViewStart other = one;
  for (Eigen::Vector3d& p : other.p_a) p *= Uniform(random, 0.9, 1.1);
  const std::vector<BetweenView> between = {{&views[1], 0.5, matches}};
  EXPECT_FALSE(
      SelectMotion({one, other}, {}, views[0], views[2], between, SmallCamera()).has_value());
}

// The whole tracker on pictures of a flat field.
TEST(SelectMotion, StartsTheRightWayOverAFlatFieldInEveryDirection) {
  const TexturedGround ground(false);
  constexpr int kNumFrames = 14;
  for (const double heading : {0.0, 1.0, 2.2, 4.0}) {
    const Pose attitude = LookAt({0, -2, 10}, {1, 6, 0});
    const std::unique_ptr<Tracker> tracker = CreateTracker();
    std::vector<Pose> truth;
    for (int i = 0; i < kNumFrames; ++i) {
      const Eigen::Vector3d eye(3 + 0.2 * i * std::cos(heading), -2 + 0.2 * i * std::sin(heading),
                                10);
      truth.emplace_back(attitude.rotation(), eye);
      Frame frame;
      frame.index = i;
      frame.timestamp_s = 0.1 * i;
      frame.name = "frame " + std::to_string(i);
      frame.camera = SmallCamera();
      frame.bgr = ground.Render(frame.camera, truth.back());
      static_cast<void>(tracker->Track(frame));
    }
    const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
    ASSERT_GE(trajectory.size(), 10U) << heading;
    const auto first = static_cast<std::size_t>(trajectory.front().frame_index);
    const Pose found = trajectory.front().T_world_cam.Inverse() * trajectory.back().T_world_cam;
    const Pose expected = truth[first].Inverse() * truth.back();
    EXPECT_LT(found.RotationAngle() * kDegreesOfSelection, kMaxSelectedRotationErrorDeg) << heading;
    EXPECT_GT(found.translation().normalized().dot(expected.translation().normalized()),
              std::cos(kMaxSelectedDirectionErrorDeg / kDegreesOfSelection))
        << heading;
  }
}

}  // namespace
}  // namespace mono3d::tracking
