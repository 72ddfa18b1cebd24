// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/calibration_maps.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "mono3d/geometry/distortion.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "reference/random.h"
#include "tracking/tracking_world.h"

namespace mono3d::calibration {

CameraModel TrueCamera() {
  return {640, 480, 560, 560, 324, 236, {-0.12, 0.05, 0.0004, -0.0003, 0}};
}

CameraPrior UnknownCamera() { return DefaultCameraPrior(640, 480); }

SparseModel MakeMap(const CameraModel& camera, Way way, unsigned seed, double sway_of_strip) {
  std::mt19937 random(seed);
  const double relief = way == Way::kOrbit ? 3 : 0.05;
  SparseModel map;
  map.camera = camera;
  for (int i = 0; i < 300; ++i) {
    const double x = Uniform(random, -8, 8);
    const double y = Uniform(random, -8, 8);
    map.points.push_back({{x, y, Uniform(random, 0, relief)}, {}});
  }
  constexpr int kNumViews = 12;
  for (int i = 0; i < kNumViews; ++i) {
    SparseImage& image = map.images.emplace_back();
    image.id = i;
    const double angle = 2 * std::numbers::pi * i / kNumViews;
    if (way == Way::kOrbit) {
      image.T_world_cam = tracking::LookAt({9 * std::cos(angle), 9 * std::sin(angle), 10},
                                           {0.5 * std::sin(3 * angle), 0, 0});
    } else {
      const double x = 0.8 * i - 4;
      const Eigen::Vector3d sway(std::sin(3 * i), std::cos(2 * i), 0);
      image.T_world_cam =
          tracking::LookAt({x, 0.001, 12}, Eigen::Vector3d(x, 0, 0) + sway_of_strip * sway);
    }
    const Pose T_cam_world = image.T_world_cam.Inverse();
    for (std::size_t k = 0; k < map.points.size(); ++k) {
      const Eigen::Vector3d p_cam = T_cam_world * map.points[k].p_world;
      if (p_cam.z() <= 0) continue;
      Eigen::Vector2d pixel = ProjectDistorted(camera, p_cam);
      if (!camera.Contains(pixel)) continue;
      for (double& coordinate : pixel) coordinate += Normal(random, kNoise_px);
      image.observations.push_back({pixel, k});
    }
  }
  return map;
}

SparseModel MakeRollingMap(const CameraModel& camera, unsigned seed) {
  std::mt19937 random(seed);
  SparseModel map = MakeMap(camera, Way::kOrbit, seed);
  for (SparseImage& image : map.images) {
    image.velocity = CameraVelocity();
    for (Eigen::Index i = 0; i < 3; ++i) {
      image.velocity->angular_rad_per_s[i] = Normal(random, 0.2);
      image.velocity->linear_su_per_s[i] = Normal(random, 1);
    }
    const ShutterMotion motion(camera, *image.velocity);
    const Pose T_cam_world = image.T_world_cam.Inverse();
    std::erase_if(image.observations, [&](SparseObservation& observation) {
      const Eigen::Vector3d p_cam = T_cam_world * map.points[*observation.point].p_world;
      observation.pixel = ProjectDistorted(camera, motion.AtItsLine(p_cam));
      for (double& coordinate : observation.pixel) coordinate += Normal(random, kNoise_px);
      return !camera.Contains(observation.pixel);
    });
  }
  return map;
}

SparseModel MakeBlock(const CameraModel& camera, unsigned seed, double higher) {
  std::mt19937 random(seed);
  SparseModel map;
  map.camera = camera;
  for (int i = 0; i < 400; ++i) {
    const double x = Uniform(random, -10, 10);
    const double y = Uniform(random, -8, 8);
    map.points.push_back({{x, y, Uniform(random, 0, 0.05)}, {}});
  }
  for (int i = 0; i < 24; ++i) {
    SparseImage& image = map.images.emplace_back();
    image.id = 3 * i;
    const Eigen::Vector3d eye(2.4 * (i % 6) - 6, 3. * (i / 6) - 4.5, i % 2 == 0 ? 8 : 8 + higher);
    image.T_world_cam = tracking::LookAt(eye + Eigen::Vector3d(0, 0.001, 0), {eye.x(), eye.y(), 0});
    const Pose T_cam_world = image.T_world_cam.Inverse();
    for (std::size_t k = 0; k < map.points.size(); ++k) {
      Eigen::Vector2d pixel = ProjectDistorted(camera, T_cam_world * map.points[k].p_world);
      if (!camera.Contains(pixel)) continue;
      for (double& coordinate : pixel) coordinate += Normal(random, kNoise_px);
      image.observations.push_back({pixel, k});
    }
  }
  return map;
}

CameraPositions MeasurePositions(const SparseModel& map, double sigma_m) {
  std::mt19937 random(17);
  CameraPositions positions;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  positions.S_metric_map = Similarity(5, Pose(turn, Eigen::Vector3d(900, -40, 70)));
  for (const SparseImage& image : map.images) {
    CameraPosition& position = positions.positions.emplace_back();
    position.frame_index = image.id;
    position.sigma_m = Eigen::Vector3d::Constant(sigma_m);
    position.p_m = positions.S_metric_map * image.T_world_cam.translation();
    for (double& coordinate : position.p_m) coordinate += Normal(random, sigma_m);
  }
  return positions;
}

CameraModel SecondCamera() { return {500, 600, 700, 700, 240, 310, {0.08, 0, 0, 0, 0}}; }

SparseModel MakeMapOfTwo(int every, unsigned seed) {
  const SparseModel first = MakeMap(TrueCamera(), Way::kOrbit, seed);
  const SparseModel second = MakeMap(SecondCamera(), Way::kOrbit, seed);
  SparseModel map = first;
  map.further_cameras = {SecondCamera()};
  for (std::size_t i = 0; i < map.images.size(); i += static_cast<std::size_t>(every)) {
    map.images[i] = second.images[i];
    map.images[i].camera = 1;
  }
  return map;
}

}  // namespace mono3d::calibration
