// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/up.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "geometry/camera_over.h"

namespace mono3d {
namespace {

constexpr double kDegreeOfUp = std::numbers::pi / 180;
constexpr double kHeightOfUp = 1;  // of flight

// Over ground with walls, half of them across the others, in a world with z up.
class FlightOverGround {
 public:
  explicit FlightOverGround(double share_of_walls, double angle_of_walls = 0.4) {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.05);
    for (int i = 0; i < 2000; ++i) {
      const bool is_wall = i < share_of_walls * 2000;
      const double angle = angle_of_walls + (i % 2 == 0 ? 0 : std::numbers::pi / 2);
      Eigen::Vector3d normal = is_wall ? Eigen::Vector3d(std::cos(angle), -std::sin(angle), 0)
                                       : Eigen::Vector3d(0, 0, 1);
      normal += Eigen::Vector3d(noise(random), noise(random), noise(random));
      normals_.push_back(normal.normalized());
    }
  }

  void Add(const Pose& T_world_cam) { cameras_.push_back(T_world_cam); }

  // Between z and the up that is found in the frame of the first camera, as the tracker has it.
  double Tilt_deg(int turn_deg = 0) const {
    const Pose T_first_world = cameras_.front().Inverse();
    std::vector<Pose> cameras;
    for (const Pose& camera : cameras_) cameras.push_back(T_first_world * camera);
    std::vector<Eigen::Vector3f> normals;
    for (const Eigen::Vector3d& normal : normals_) {
      normals.push_back((T_first_world.rotation() * normal).cast<float>());
    }
    const auto up = FindUp(cameras, normals, turn_deg);
    if (!up) return 180;
    const double cosine = (cameras_.front().rotation() * *up).z();
    return std::acos(std::clamp(cosine, -1.0, 1.0)) / kDegreeOfUp;
  }

 private:
  std::vector<Pose> cameras_;
  std::vector<Eigen::Vector3d> normals_;
};

TEST(FindUp, GoesByTheHorizonOfTheCamerasOnAnOrbit) {
  FlightOverGround flight(0.95);  // hardly any ground
  std::mt19937 random(2);
  std::normal_distribution<double> roll_deg(0, 1);
  for (int i = 0; i < 24; ++i) {
    const double angle = 5.0 * i * kDegreeOfUp;
    flight.Add(CameraOver({std::sin(angle), -std::cos(angle), kHeightOfUp}, -5.0 * i, 40,
                          roll_deg(random)));
  }
  EXPECT_LT(flight.Tilt_deg(), 2);
}

TEST(FindUp, GoesByTheImagesOfACameraHeldUprightAsTheyAreShown) {
  // Images to be turned clockwise are of a camera that was turned clockwise.
  for (const int turn_deg : {90, 180, 270}) {
    FlightOverGround flight(0.95);
    const auto camera = [&](int i) {
      const double angle = 5.0 * i * kDegreeOfUp;
      return CameraOver({std::sin(angle), -std::cos(angle), kHeightOfUp}, -5.0 * i, 40, turn_deg);
    };
    for (int i = 0; i < 24; ++i) flight.Add(camera(i));
    EXPECT_LT(flight.Tilt_deg(turn_deg), 2) << turn_deg;
  }
}

TEST(FindUp, GoesByTheGroundOnAStraightPass) {
  for (const double down_deg : {20, 45, 90}) {
    FlightOverGround flight(0.5);
    for (int i = 0; i < 24; ++i) flight.Add(CameraOver({0.05 * i, -1, kHeightOfUp}, 0, down_deg));
    EXPECT_LT(flight.Tilt_deg(), 3) << down_deg;
  }
}

TEST(FindUp, GoesByTheGroundWhereADroneRises) {
  // Straight up, the view from the horizon downwards as a gimbal turns it, or straight down.
  for (const double down_deg : {15, 90}) {
    FlightOverGround flight(0.4, 0);  // half of the walls face the camera
    const auto camera = [&](int i) {
      const double share = down_deg == 90 ? 1 : i / 23.0;
      return CameraOver({0, -1, 0.05 + 0.05 * i}, 0, share * down_deg);
    };
    for (int i = 0; i < 24; ++i) flight.Add(camera(i));
    EXPECT_LT(flight.Tilt_deg(), 3) << down_deg;
  }
}

TEST(FindUp, GoesByTheGroundWhereADroneFliesBackwardsAndUp) {
  FlightOverGround flight(0.7, 0);
  const auto camera = [](int i) { return CameraOver({0, -0.1 - 0.04 * i, 0.1 + 0.04 * i}, 0, 45); };
  for (int i = 0; i < 24; ++i) flight.Add(camera(i));
  EXPECT_LT(flight.Tilt_deg(), 3);
}

TEST(FindUp, NeedsThreeCameras) {
  const std::vector<Eigen::Vector3f> ground(100, Eigen::Vector3f::UnitZ());
  EXPECT_FALSE(FindUp(std::vector<Pose>(2, CameraOver({0, 0, 1}, 0, 45)), ground));
  EXPECT_TRUE(FindUp(std::vector<Pose>(3, CameraOver({0, 0, 1}, 0, 45)), ground));
}

}  // namespace
}  // namespace mono3d
