// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d::synthetic {
namespace {

constexpr double kFlightRounding = 1e-9;  // of double-precision geometry at some 100 m

TEST(LookAt, PutsTheTargetAtThePrincipalPointAndUpAtTheTop) {
  const Eigen::Vector3d eye(40, -30, 50);
  const Eigen::Vector3d target(2, 3, 1);
  const Pose T_cam_world = LookAt(eye, target).Inverse();
  const CameraModel camera{320, 192, 288, 288, 159.5, 95.5};
  const Eigen::Vector3d target_cam = T_cam_world * target;
  EXPECT_NEAR(target_cam.z(), (target - eye).norm(), kFlightRounding);
  EXPECT_NEAR((camera.Project(target_cam) - Eigen::Vector2d(159.5, 95.5)).norm(), 0, 1e-6);
  const Eigen::Vector3d above_cam = T_cam_world * (target + Eigen::Vector3d::UnitZ());
  EXPECT_LT(above_cam.y(), 0);
  EXPECT_NEAR(above_cam.x(), 0, kFlightRounding);
}

TEST(LookAt, RefusesALineOfSightWithoutHorizon) {
  EXPECT_THROW(LookAt({1, 2, 50}, {1, 2, 0}), Error);
}

FlightOptions OfKind(const std::string& kind) {
  FlightOptions options;
  options.kind = kind;
  options.duration_s = 90;
  return options;
}

Eigen::Vector3d Ahead(const Pose& T_world_cam) {
  return T_world_cam.rotation() * Eigen::Vector3d::UnitZ();
}

double Speed(const Flight& flight, double t_s) {
  constexpr double kStep_s = 1e-3;
  return (flight.PoseAt(t_s + kStep_s).translation() - flight.PoseAt(t_s - kStep_s).translation())
             .norm() /
         (2 * kStep_s);
}

TEST(Flight, OfEveryKindStartsAndEndsAtRestAndNeverJumps) {
  for (const char* kind : kFlightKinds) {
    const Flight flight(OfKind(kind));
    const double end_s = flight.duration_s();
    EXPECT_NEAR(end_s, 90, 1e-6) << kind;
    // A ramp's speed grows with 3 x^2: in the first hundredth of 3 s to 3e-4 of 1.4 m/s.
    EXPECT_LT(Speed(flight, 0.03), 1e-3) << kind;
    EXPECT_LT(Speed(flight, end_s - 0.03), 1e-3) << kind;
    Pose before = flight.PoseAt(0);
    for (double t_s = 0.1; t_s < end_s; t_s += 0.1) {
      const Pose now = flight.PoseAt(t_s);
      const Pose T_before_now = before.Inverse() * now;
      EXPECT_LT(T_before_now.translation().norm(), 0.1 * 1.4 + kFlightRounding) << kind << t_s;
      // The fastest is the lawnmower's turn: 1.5 times 1.4 m/s over a radius of 12.5 m.
      EXPECT_LT(T_before_now.RotationAngle(), 0.1 * 0.17) << kind << t_s;
      before = now;
    }
  }
}

TEST(Flight, KeepsItsSpeedAndHeightOnceUnderWay) {
  const auto ground = [](const Eigen::Vector2d&) { return 7.0; };
  for (const char* kind : {"orbit", "lawnmower", "cruise", "lateral"}) {
    const Flight flight(OfKind(kind), ground);
    EXPECT_NEAR(Speed(flight, 40), 1.4, 1e-5) << kind;
    EXPECT_NEAR(flight.PoseAt(40).translation().z(), 71 + 7, kFlightRounding) << kind;
  }
}

TEST(Flight, OrbitThatClosesEndsWhereItBeganAndLooksAtItsTarget) {
  FlightOptions options = OfKind("orbit");
  options.full_circle = true;
  options.target_x_m = 12;
  options.target_y_m = -5;
  const Flight flight(options);
  const Pose T_begin_end = flight.PoseAt(0).Inverse() * flight.PoseAt(flight.duration_s());
  EXPECT_LT(T_begin_end.translation().norm(), 1e-6);
  EXPECT_LT(T_begin_end.RotationAngle(), 1e-6);
  EXPECT_NEAR(flight.duration_s(), 2 * std::numbers::pi * 80 / 1.4 + 3, 1e-6);
  const Pose somewhere = flight.PoseAt(100);
  const Eigen::Vector3d to_target = Eigen::Vector3d(12, -5, 0) - somewhere.translation();
  EXPECT_LT((Ahead(somewhere) - to_target.normalized()).norm(), kFlightRounding);
}

TEST(Flight, CruiseLooksOnAverageAtItsTarget) {
  FlightOptions options = OfKind("cruise");
  options.heading_deg = 90;
  options.target_x_m = 3;
  const Flight flight(options);
  const Pose middle = flight.PoseAt(45);  // half-way; the flight is symmetric in time
  const Eigen::Vector3d ahead = Ahead(middle);
  const Eigen::Vector3d seen = middle.translation() - middle.translation().z() / ahead.z() * ahead;
  EXPECT_LT((seen - Eigen::Vector3d(3, 0, 0)).norm(), 1e-6);
  EXPECT_LT((Ahead(flight.PoseAt(0)) - ahead).norm(), kFlightRounding);
}

TEST(Flight, LawnmowerTurnsRoundAtTheEndOfEachRow) {
  FlightOptions options = OfKind("lawnmower");
  options.row_length_m = 30;
  const Flight flight(options);
  // A row of 30 m and a half circle of 39.3 m, 49.5 s, and half of a ramp before.
  const Eigen::Vector3d first = Ahead(flight.PoseAt(5));
  const Eigen::Vector3d second = Ahead(flight.PoseAt(55));
  EXPECT_NEAR(first.head<2>().normalized().dot(second.head<2>().normalized()), -1, kFlightRounding);
  const Eigen::Vector3d across = flight.PoseAt(55).translation() - flight.PoseAt(5).translation();
  EXPECT_NEAR(across.y(), options.row_spacing_m, 1e-6);  // to the left of the heading
}

TEST(Flight, TakeOffRisesFromTheHorizonToItsPitch) {
  const FlightOptions options = OfKind("take_off");
  const Flight flight(options);
  const double climb_s = (71 - 5) / 1.4 + 3;
  EXPECT_NEAR(flight.PoseAt(0).translation().z(), 5, kFlightRounding);
  EXPECT_NEAR(Ahead(flight.PoseAt(0)).z(), 0, kFlightRounding);
  const Pose top = flight.PoseAt(climb_s);
  EXPECT_LT((top.translation() - Eigen::Vector3d(0, 0, 71)).norm(), 1e-6);
  EXPECT_NEAR(-Ahead(top).z(), std::sin(40 * std::numbers::pi / 180), 1e-6);
  EXPECT_GT(flight.PoseAt(90).translation().x(), 10);  // then on ahead
}

TEST(Flight, RocketRisesLookingStraightDown) {
  const Flight flight(OfKind("rocket"));
  for (const double t_s : {0.0, 20.0, 90.0}) {
    EXPECT_NEAR(Ahead(flight.PoseAt(t_s)).z(), -1, kFlightRounding);
    EXPECT_LT(flight.PoseAt(t_s).translation().head<2>().norm(), 1e-6);
  }
  EXPECT_NEAR(flight.PoseAt(0).translation().z(), 5, kFlightRounding);
  EXPECT_NEAR(flight.PoseAt(90).translation().z(), 71, 1e-6);
}

TEST(Flight, DronieAndHelixLookAtTheTargetWhileTheyLeaveIt) {
  for (const char* kind : {"dronie", "helix"}) {
    FlightOptions options = OfKind(kind);
    options.speed_m_per_s = 4;
    options.target_x_m = 3;
    const Flight flight(options);
    for (const double t_s : {0.0, 5.0, 20.0, 90.0}) {
      const Pose pose = flight.PoseAt(t_s);
      const Eigen::Vector3d to_target = Eigen::Vector3d(3, 0, 0) - pose.translation();
      EXPECT_LT((to_target.normalized() - Ahead(pose)).norm(), 1e-6) << kind;
    }
    EXPECT_NEAR(flight.PoseAt(0).translation().z(), 5, 1e-6) << kind;
    EXPECT_NEAR(flight.PoseAt(89).translation().z(), 71, 1e-6) << kind;
    const Eigen::Vector3d end = flight.PoseAt(89).translation() - Eigen::Vector3d(3, 0, 0);
    EXPECT_NEAR(end.head<2>().norm(), options.radius_m, 1e-6) << kind;
  }
  // A dronie stays in one vertical plane, a helix goes once around.
  FlightOptions options = OfKind("helix");
  options.speed_m_per_s = 4;
  const Flight helix(options);
  EXPECT_GT(helix.PoseAt(0).translation().x(), 0);
  double least_x = 0;
  for (int t_s = 0; t_s < 90; ++t_s) {
    least_x = std::min(least_x, helix.PoseAt(t_s).translation().x());
  }
  EXPECT_LT(least_x, -30);
  options.kind = "dronie";
  const Flight dronie(options);
  for (int t_s = 0; t_s < 90; ++t_s) {
    EXPECT_NEAR(dronie.PoseAt(t_s).translation().y(), 0, 1e-9);
    EXPECT_LT(dronie.PoseAt(t_s).translation().x(), 0);
  }
}

TEST(Flight, StopAndTurnTurnsInPlace) {
  const Flight flight(OfKind("stop_and_turn"));
  const double turn_s = 60.0 / 8 + 3;
  const Pose begin = flight.PoseAt(45 - turn_s / 2);
  const Pose end = flight.PoseAt(45 + turn_s / 2);
  EXPECT_LT((begin.translation() - end.translation()).norm(), 1e-6);
  const Eigen::Vector2d from = Ahead(begin).head<2>().normalized();
  const Eigen::Vector2d to = Ahead(end).head<2>().normalized();
  EXPECT_NEAR(from.dot(to), 0.5, 1e-6);                 // cosine of 60 degrees
  EXPECT_GT(from.x() * to.y() - from.y() * to.x(), 0);  // to the left
}

TEST(Flight, StopAndTurnMayBeginSidewaysHoverAndClimb) {
  FlightOptions options = OfKind("stop_and_turn");
  options.sideways_s = 10;
  options.hover_s = 4;
  options.climb_deg = 30;
  const Flight flight(options);
  EXPECT_NEAR(flight.duration_s(), 90, 1e-6);
  const Pose start = flight.PoseAt(0);
  const Pose stop = flight.PoseAt(10);
  const Eigen::Vector3d right = start.rotation() * Eigen::Vector3d::UnitX();
  const Eigen::Vector3d aside = stop.translation() - start.translation();
  EXPECT_LT((aside - (10 - 3) * 1.4 * right).norm(), 1e-6);
  const Pose hovering = flight.PoseAt(13.9);
  EXPECT_LT((stop.Inverse() * hovering).RotationAngle(), 1e-9);
  const double turned_s = 10 + 4 + 60.0 / 8 + 3;
  EXPECT_LT((flight.PoseAt(turned_s).translation() - stop.translation()).norm(), 1e-6);
  const Eigen::Vector3d on = flight.PoseAt(90).translation() - stop.translation();
  EXPECT_NEAR(on.z() / on.norm(), 0.5, 1e-6);
  const Eigen::Vector2d ahead = Ahead(flight.PoseAt(90)).head<2>().normalized();
  EXPECT_NEAR(on.head<2>().normalized().dot(ahead), 1, 1e-6);
}

TEST(Flight, ArmMovesTheCameraAboutTheAxisOfYaw) {
  FlightOptions options = OfKind("stop_and_turn");
  options.sideways_s = 10;
  options.arm_m = 0.1;
  const Flight flight(options);
  const Pose stop = flight.PoseAt(10);
  const Pose turned = flight.PoseAt(10 + 60.0 / 8 + 3);
  EXPECT_NEAR((turned.translation() - stop.translation()).norm(), 0.1, 1e-6);  // 2 sin 30 degrees
}

TEST(Unsteadiness, HasItsAmplitudeAndFollowsItsSeed) {
  FlightOptions steady = OfKind("cruise");
  FlightOptions options = steady;
  options.unsteadiness.position_m = 0.3;
  options.unsteadiness.rotation_deg = 0.5;
  const Flight path(steady);
  const Flight flight(options);
  double shift_square = 0;
  double turn_square = 0;
  constexpr int kNumTimes = 2000;
  for (int i = 0; i < kNumTimes; ++i) {
    const Pose T_path_hand = path.PoseAt(i).Inverse() * flight.PoseAt(i);
    shift_square += T_path_hand.translation().squaredNorm() / (3 * kNumTimes);
    turn_square += std::pow(T_path_hand.RotationAngle(), 2) / (3 * kNumTimes);
  }
  // Sums of few swings over many of their periods: a few percent.
  EXPECT_NEAR(std::sqrt(shift_square), 0.3, 0.02);
  EXPECT_NEAR(std::sqrt(turn_square) * 180 / std::numbers::pi, 0.5, 0.03);
  EXPECT_EQ(flight.PoseAt(9).translation(), Flight(options).PoseAt(9).translation());
  options.unsteadiness.seed = 2;
  EXPECT_NE(flight.PoseAt(9).translation(), Flight(options).PoseAt(9).translation());
}

TEST(Flight, RefusesBadOptions) {
  EXPECT_THROW(Flight(OfKind("loop")), UsageError);
  FlightOptions options;
  options.duration_s = 5;  // less than two ramps
  EXPECT_THROW(Flight{options}, UsageError);
  for (const char* kind : {"take_off", "rocket", "dronie", "helix"}) {
    options = OfKind(kind);
    options.take_off_height_m = 80;
    EXPECT_THROW(Flight{options}, UsageError) << kind;
  }
  options = OfKind("stop_and_turn");
  options.turn_deg = 3600;
  EXPECT_THROW(Flight{options}, UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
