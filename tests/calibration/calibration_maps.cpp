// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/calibration_maps.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "calibration/camera_problem.h"
#include "calibration/camera_solver.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "reference/random.h"
#include "tracking/tracking_world.h"

namespace mono3d::calibration {
namespace {

// How a point moves in the image for each component of a velocity, angular and linear.
Eigen::Matrix<double, 2, 6> FlowByVelocity(const CameraModel& camera,
                                           const Eigen::Vector3d& p_cam) {
  constexpr double kMoment_s = 1e-5;
  Eigen::Matrix<double, 2, 6> J;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i % 3);
    const Eigen::Vector3d moved = kMoment_s * (i < 3 ? axis.cross(p_cam) : axis);
    J.col(i) = (ProjectDistorted(camera, p_cam + moved) - ProjectDistorted(camera, p_cam - moved)) /
               (2 * kMoment_s);
  }
  return J;
}

// The velocity that moves an image of `to` as it moves in `from`, by least squares.
CameraVelocity SameFlow(const SparseModel& from, const SparseImage& image_from,
                        const SparseModel& to, const SparseImage& image_to) {
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 1> velocity;
  velocity << image_from.velocity->angular_rad_per_s, image_from.velocity->linear_su_per_s;
  for (const SparseObservation& seen : image_to.observations) {
    const auto by_velocity = [&](const SparseModel& map, const SparseImage& image) {
      return FlowByVelocity(map.camera,
                            image.T_world_cam.Inverse() * map.points[*seen.point].p_world);
    };
    const Eigen::Vector2d flow = by_velocity(from, image_from) * velocity;
    const Eigen::Matrix<double, 2, 6> J = by_velocity(to, image_to);
    information += J.transpose() * J;
    gradient += J.transpose() * flow;
  }
  velocity = information.ldlt().solve(gradient);
  CameraVelocity result;
  result.angular_rad_per_s = velocity.head<3>();
  result.linear_su_per_s = velocity.tail<3>();
  return result;
}

}  // namespace

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

SparseModel MakeRollingMap(const CameraModel& camera, unsigned seed, Way way,
                           double sway_of_strip) {
  std::mt19937 random(seed);
  SparseModel map = MakeMap(camera, way, seed, sway_of_strip);
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

SparseModel TrackedWith(const CameraModel& other, const SparseModel& map) {
  const std::vector<SparseModel> maps = {map};
  CameraPrior held = UnknownCamera();
  held.camera = other;
  held.focal_sigma = held.principal_point_sigma_px = held.readout_sigma_s = 0;
  held.distortion_sigma = {};
  CameraProblem problem({.maps = maps}, other, held);
  for (int i = 0; i < 3; ++i) Solve(problem, 1e-8);
  SparseModel result = map;
  result.camera = other;
  for (std::size_t i = 0; i < map.images.size(); ++i) {
    SparseImage& image = result.images[i];
    const CameraProblem::PoseBlock& pose = problem.unknowns().poses[i];
    const Eigen::Vector3d turn(pose.data());
    const Eigen::Quaterniond rotation(turn.norm() > 0
                                          ? Eigen::AngleAxisd(turn.norm(), turn.normalized())
                                          : Eigen::AngleAxisd::Identity());
    image.T_world_cam = Pose(rotation, Eigen::Vector3d(pose.data() + 3)).Inverse();
  }
  std::vector<bool> is_used(map.points.size(), false);
  for (const CameraProblem::Observation& seen : problem.observations()) {
    // Points are numbered as they are observed: found again by their pixels.
    for (const SparseObservation& of : map.images[seen.image].observations) {
      if (seen.is_flow || of.pixel != seen.measured) continue;
      result.points[*of.point].p_world =
          Eigen::Vector3d(problem.unknowns().points[seen.point].data());
      is_used[*of.point] = true;
    }
  }
  for (std::size_t i = 0; i < map.images.size(); ++i) {
    SparseImage& image = result.images[i];
    std::erase_if(image.observations, [&](const auto& of) { return !is_used[*of.point]; });
    image.velocity = SameFlow(map, map.images[i], result, image);
  }
  return result;
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
