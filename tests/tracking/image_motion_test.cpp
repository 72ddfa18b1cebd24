// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A camera in the hand before a wall: it walks by and sways, and its lines are read one after the
// other.

#include "tracking/features/image_motion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "mono3d/geometry/rolling_shutter.h"
#include "mono3d/geometry/two_view_ransac.h"
#include "tracking/start/map_initialiser.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kDegreeOfMotion = std::numbers::pi / 180;
constexpr double kInterval_s = 0.05;
constexpr double kReadoutOfMotion_s = 0.022;
constexpr double kNoiseOfMotion_px = 0.1;

CameraModel SensorInTheHand() {
  CameraModel sensor = SmallCamera();
  sensor.shutter.readout_s = kReadoutOfMotion_s;
  return sensor;
}

// The wall is the plane z = 6 of the world.
Pose Walk_T_cam_world(double time_s) {
  const auto swing = [&](double degrees, double hz, double phase) {
    return degrees * kDegreeOfMotion * std::sin(2 * std::numbers::pi * hz * time_s + phase);
  };
  const Pose T_world_cam(
      RotationExp({swing(2, 1.3, 0.4), swing(3, 1, 0), swing(1.5, 1.1, 2)}),
      {1.3 * time_s, 0.03 * std::sin(5 * time_s), 0.02 * std::sin(4 * time_s + 1)});
  return T_world_cam.Inverse();
}

// Where the camera shows a point whose lines are all read at `time_s`, or each at its own time.
Eigen::Vector2d WithGlobalShutter(const Eigen::Vector3d& p_world, double time_s) {
  return SmallCamera().Project(Walk_T_cam_world(time_s) * p_world);
}

Eigen::Vector2d WithRollingShutter(const Eigen::Vector3d& p_world, double time_s) {
  const ShutterMotion lines(SensorInTheHand(), {});
  Eigen::Vector2d pixel = WithGlobalShutter(p_world, time_s);
  for (int i = 0; i < 6; ++i) {
    pixel = WithGlobalShutter(p_world, time_s + lines.Time_s(SmallCamera().Unproject(pixel)));
  }
  return pixel;
}

// Points all over what is seen at `time_s`.
std::vector<Eigen::Vector3d> PointsOfTheWall(double time_s, std::mt19937& random) {
  const Pose T_world_cam = Walk_T_cam_world(time_s).Inverse();
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 250; ++i) {
    const Eigen::Vector2d pixel(Uniform(random, 40, 340), Uniform(random, 20, 200));
    const Eigen::Vector3d ray = T_world_cam.rotation() * SmallCamera().Unproject(pixel);
    points.emplace_back(T_world_cam.translation() +
                        (6 - T_world_cam.translation().z()) / ray.z() * ray);
  }
  return points;
}

TEST(ImageMotion, TakesPixelsToTheMiddleLine) {
  std::mt19937 random(SeedFromTestName());
  for (const double time_s : {0.1, 0.45, 0.8, 1.3}) {
    const std::vector<Eigen::Vector3d> points = PointsOfTheWall(time_s, random);
    const auto neighbour = [&](double later_s) {
      std::vector<PointPair> pairs;
      for (const Eigen::Vector3d& p : points) {
        const Eigen::Vector2d noise(Normal(random, 0.5), Normal(random, 0.5));
        pairs.push_back(
            {WithRollingShutter(p, time_s), WithRollingShutter(p, time_s + later_s) + noise});
      }
      return ImageMotion::Neighbour{EstimateHomography(pairs, {})->matrix, later_s};
    };
    const ImageMotion between(SmallCamera(), SensorInTheHand(),
                              {neighbour(-kInterval_s), neighbour(kInterval_s)});
    const ImageMotion newest(SmallCamera(), SensorInTheHand(),
                             {neighbour(-kInterval_s), neighbour(-2 * kInterval_s)});
    const ImageMotion second(SmallCamera(), SensorInTheHand(), {neighbour(kInterval_s)});
    double moved = 0;
    std::array<double, 3> left{};
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector2d pixel = WithRollingShutter(p, time_s);
      const Eigen::Vector2d truth = WithGlobalShutter(p, time_s);
      moved += (pixel - truth).norm() / static_cast<double>(points.size());
      std::size_t i = 0;
      for (const ImageMotion* motion : {&between, &newest, &second}) {
        left.at(i++) +=
            (motion->AtMiddleLine(pixel) - truth).norm() / static_cast<double>(points.size());
      }
    }
    EXPECT_GT(moved, 0.15) << time_s;
    EXPECT_LT(left[0], 0.03) << time_s;
    EXPECT_LT(left[1], 0.06) << time_s;
    EXPECT_LT(left[2], 0.2) << time_s;  // straight on from one neighbour
  }
}

TEST(ImageMotion, IsNoneWhereNothingIsKnown) {
  const Eigen::Vector2d pixel(12, 34);
  EXPECT_EQ(ImageMotion().AtMiddleLine(pixel), pixel);
  // A homography of nothing.
  const ImageMotion none(SmallCamera(), SensorInTheHand(), {{Eigen::Matrix3d::Zero(), 0.05}});
  EXPECT_EQ(none.AtMiddleLine(pixel), pixel);
}

// Starts over the wall from many moments of the walk.
struct Starts {
  int num_started = 0;
  int num_wrong = 0;  // turned by more than half a degree, or towards another side
};

Starts StartAllOver(const CameraModel& sensor, std::mt19937& random) {
  Starts starts;
  for (int first = 0; first < 40; first += 2) {
    MapInitialiser initialiser({}, 1);
    const std::vector<Eigen::Vector3d> points = PointsOfTheWall(kInterval_s * (first + 4), random);
    std::string reason;
    for (int i = first; i < first + 16; ++i) {
      std::vector<Eigen::Vector2d> pixels;
      for (const Eigen::Vector3d& p : points) {
        const Eigen::Vector2d noise(Normal(random, kNoiseOfMotion_px),
                                    Normal(random, kNoiseOfMotion_px));
        pixels.push_back(WithRollingShutter(p, kInterval_s * i) + noise);
      }
      View view = MakeView(SmallCamera(), pixels);
      view.frame.sensor = sensor;
      view.frame.index = i;
      view.frame.timestamp_s = kInterval_s * i;
      const std::optional<MapStart> start = initialiser.Add(std::move(view), reason);
      if (!start) continue;
      const Pose truth = Walk_T_cam_world(start->second.frame.timestamp_s) *
                         Walk_T_cam_world(start->first.frame.timestamp_s).Inverse();
      const Pose& found = start->motion.T_b_a;
      const double cosine = found.translation().normalized().dot(truth.translation().normalized());
      const double turned = (found.Inverse() * truth).RotationAngle();
      ++starts.num_started;
      starts.num_wrong +=
          turned > 0.5 * kDegreeOfMotion || cosine < std::cos(15 * kDegreeOfMotion) ? 1 : 0;
      break;
    }
  }
  return starts;
}

TEST(MapInitialiser, StartsRightBeforeAWallWhereTheCameraSways) {
  std::mt19937 random(SeedFromTestName());
  const Starts known = StartAllOver(SensorInTheHand(), random);
  EXPECT_GE(known.num_started, 18);
  EXPECT_EQ(known.num_wrong, 0);
  // Taken for a global shutter.
  const Starts unknown = StartAllOver(SmallCamera(), random);
  EXPECT_GT(unknown.num_wrong, 2);
}

}  // namespace
}  // namespace mono3d::tracking
