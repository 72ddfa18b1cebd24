// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/world_axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "geometry/camera_over.h"

namespace mono3d {
namespace {

constexpr double kHeight = 1;  // of flight

// A flight over ground with walls, in the frame of its first camera, as the tracker has it.
class Flight {
 public:
  explicit Flight(double share_of_walls = 0.4, double angle_of_walls = 0.4) {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.05);
    std::uniform_real_distribution<double> place(-2, 2);
    for (int i = 0; i < 2000; ++i) {
      const bool is_wall = i < share_of_walls * 2000;
      const double angle = angle_of_walls + (i % 2 == 0 ? 0 : std::numbers::pi / 2);
      Eigen::Vector3d normal = is_wall ? Eigen::Vector3d(std::cos(angle), -std::sin(angle), 0)
                                       : Eigen::Vector3d(0, 0, 1);
      normal += Eigen::Vector3d(noise(random), noise(random), noise(random));
      map_.model.points.emplace_back(
          Eigen::Vector3d(place(random), place(random), is_wall ? 0.2 * place(random) + 0.4 : 0)
              .cast<float>());
      map_.model.normals.push_back(normal.normalized().cast<float>());
      map_.model.radii.push_back(0.01F);
    }
  }

  void Add(const Pose& T_world_cam) {
    const auto index = static_cast<std::int64_t>(map_.keyframes.size());
    map_.keyframes.push_back({index, 0.1 * static_cast<double>(index), 0, T_world_cam});
  }

  // `tilt` instead of the frame of the first camera.
  MapReconstruction AsTracked() const {
    MapReconstruction map = map_;
    map.trajectory = map.keyframes;
    MoveWorld(Similarity(1, map_.keyframes.front().T_world_cam.Inverse()), map);
    return map;
  }

 private:
  MapReconstruction map_;
};

TEST(WorldAxes, HaveTheViewAlongYAndTheOriginOnTheGround) {
  Flight flight;
  for (int i = 0; i < 24; ++i) flight.Add(CameraOver({0.05 * i, -1, kHeight}, 30, 45));
  MapReconstruction map = flight.AsTracked();
  const double mean_distance_before = map.model.points[0].norm();
  EXPECT_GT(mean_distance_before, 0);
  MoveInto(ChooseWorldAxes(map), map);
  EXPECT_EQ(map.axes.source, AxesSource::kLevel);
  EXPECT_EQ(map.axes.S_axes_world.scale(), 1) << "the unit is that of the depth maps";
  const Pose& first = map.keyframes.front().T_world_cam;
  const Eigen::Vector3d view = first.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(view.x(), 0, 0.02);
  EXPECT_GT(view.y(), 0.6);
  EXPECT_NEAR(first.translation().z(), kHeight, 0.1);
  double mean_x = 0;
  for (const Eigen::Vector3f& point : map.model.points) mean_x += point.x() / 2000;
  EXPECT_NEAR(mean_x, 0, 0.15);
}

TEST(WorldAxes, MoveEverythingThatIsInTheWorld) {
  Flight flight;
  for (int i = 0; i < 3; ++i) flight.Add(CameraOver({0.2 * i, -1, kHeight}, 0, 45));
  MapReconstruction map = flight.AsTracked();
  SparseImage image;
  image.T_world_cam = map.keyframes[1].T_world_cam;
  image.velocity = CameraVelocity{.linear_su_per_s = {1, 0, 0}};
  map.sparse.images.push_back(image);
  map.sparse.points.push_back({map.model.points[0].cast<double>(), {}});
  map.online_trajectory = map.model_trajectory = map.keyframes;
  const MapReconstruction before = map;
  const Similarity S(2, Pose(RotationExp({0.3, -0.2, 0.9}), {1, 2, 3}));
  MoveInto({S, AxesSource::kSavedMap}, map);
  for (const auto* entries :
       {&map.trajectory, &map.online_trajectory, &map.keyframes, &map.model_trajectory}) {
    EXPECT_LT(((*entries)[1].T_world_cam.Matrix() - (S * before.keyframes[1].T_world_cam).Matrix())
                  .norm(),
              1e-12);
  }
  // The camera sees what it saw, twice as far away.
  const auto seen = [](const MapReconstruction& in, std::size_t i) -> Eigen::Vector3d {
    return in.keyframes[1].T_world_cam.Inverse() * in.model.points[i].cast<double>();
  };
  EXPECT_LT((seen(map, 7) - 2 * seen(before, 7)).norm(), 1e-5);
  const auto facing = [](const MapReconstruction& in) -> Eigen::Vector3d {
    return in.keyframes[1].T_world_cam.rotation().inverse() * in.model.normals[7].cast<double>();
  };
  EXPECT_LT((facing(map) - facing(before)).norm(), 1e-5);
  EXPECT_FLOAT_EQ(map.model.radii[7], 0.02F);
  EXPECT_LT((map.sparse.points[0].p_world - map.model.points[0].cast<double>()).norm(), 1e-5);
  EXPECT_EQ(map.sparse.images[0].velocity->linear_su_per_s.x(), 2);
}

TEST(WorldAxes, AreLevelAsFarAsIsKnown) {
  const Similarity turned(1, Pose(RotationExp({-1, 0, 0}), {1, 2, 3}));
  EXPECT_TRUE(IsLevel({turned, AxesSource::kLevel}));
  EXPECT_TRUE(IsLevel({turned, AxesSource::kSavedMap}));
  EXPECT_FALSE(IsLevel({}));
  EXPECT_FALSE(IsLevel({{}, AxesSource::kSavedMap})) << "those of the first camera were kept";
}

TEST(WorldAxes, OfTwoKeyframesAreThoseOfTheFirstCamera) {
  Flight flight;
  flight.Add(CameraOver({0, -1, kHeight}, 0, 45));
  flight.Add(CameraOver({0.1, -1, kHeight}, 0, 45));
  EXPECT_EQ(ChooseWorldAxes(flight.AsTracked()).source, AxesSource::kFirstCamera);
}

}  // namespace
}  // namespace mono3d
