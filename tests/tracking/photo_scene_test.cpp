// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_scene.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "tracking/photos/mirrored_pose.h"

namespace mono3d::tracking {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr CameraModel kWallCamera{
    .width = 768, .height = 576, .fx = 640, .fy = 640, .cx = 383.5, .cy = 287.5};

// A long wall with windows that repeat, seen by three photos. In the third a fifth of the features
// is taken for those of a place 12 su farther on.
struct Wall {
  std::vector<Pose> T_cam_world;
  std::vector<PhotoFeatures> photos;
  std::vector<PhotoPair> pairs;
  std::size_t num_right = 0;
};

Wall MakeWall() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> noise_px(0, 0.2);
  Wall wall;
  wall.photos.resize(3);
  for (const double x : {-1.5, 1.5, 0.0}) {
    wall.T_cam_world.push_back(Pose(Eigen::Quaterniond::Identity(), Vector3d(-x, 0, 0)));
  }
  wall.pairs = {{0, 1, {}}, {1, 2, {}}};
  for (std::size_t i = 0; i < 500; ++i) {
    const bool is_wrong = i % 5 == 0;
    const double x_su = is_wrong ? 12 + 2 * uniform(random) : 5 * uniform(random);
    const Vector3d p_world(x_su, 3 * uniform(random), 10 + 0.3 * uniform(random));
    for (std::size_t photo = 0; photo < 3; ++photo) {
      const Vector3d repeated = p_world - Vector3d(is_wrong && photo == 2 ? 12 : 0, 0, 0);
      PhotoFeatures& features = wall.photos[photo];
      features.pixels.push_back(kWallCamera.Project(wall.T_cam_world[photo] * repeated) +
                                Vector2d(noise_px(random), noise_px(random)));
      features.sigma_px.push_back(0.5);
      features.colours.push_back({});
    }
    for (PhotoPair& pair : wall.pairs) pair.matches.push_back({i, i});
    wall.num_right += is_wrong ? 0 : 1;
  }
  return wall;
}

TEST(PhotoScene, FindsAPoseAmongPointsThatAreAllOffAlike) {
  const Wall wall = MakeWall();
  PhotoScene scene(kWallCamera, wall.photos, wall.pairs, 1);
  scene.SetPose(0, wall.T_cam_world[0]);
  scene.SetPose(1, wall.T_cam_world[1]);
  scene.Triangulate();
  ASSERT_GT(scene.NumPointsFor(2), 450);
  const std::optional<Pose> found = scene.FindPose(2, 30, 1);
  ASSERT_TRUE(found);
  EXPECT_LT(found->translation().norm(), 0.01);
  scene.SetPose(2, *found);
  scene.Triangulate();
  EXPECT_GT(scene.NumFitting(2), 0.9 * static_cast<double>(wall.num_right));
  EXPECT_LT(scene.NumFitting(2), static_cast<int>(wall.num_right) + 5);
}

TEST(PhotoScene, FindsNoPoseByChance) {
  Wall wall = MakeWall();
  std::mt19937 random(4);
  for (Vector2d& pixel : wall.photos[2].pixels) {
    pixel = {double(random() % 768), double(random() % 576)};
  }
  PhotoScene scene(kWallCamera, wall.photos, wall.pairs, 1);
  scene.SetPose(0, wall.T_cam_world[0]);
  scene.SetPose(1, wall.T_cam_world[1]);
  scene.Triangulate();
  EXPECT_FALSE(scene.FindPose(2, 30, 1));
}

// A board 2 su wide, lit up by two photos close by, and seen from the side by a third from afar:
// 35 px wide, all at hardly one distance.
class Board {
 public:
  Board(double relief_su, unsigned seed) : photos_(3), pairs_{{0, 1, {}}, {1, 2, {}}} {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::normal_distribution<double> noise_px(0, 0.4);
    const auto turned = [](double angle_rad) {
      return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Vector3d::UnitY()));
    };
    for (const double x_su : {-1.5, 1.5}) {
      T_cam_world_.push_back(Pose(Eigen::Quaterniond::Identity(), Vector3d(-x_su, 0, 6)));
    }
    T_cam_world_.push_back(Pose(turned(0.5), Vector3d(0, 0, 36)));
    for (std::size_t i = 0; i < 200; ++i) {
      const Vector3d p_world(uniform(random), uniform(random), relief_su * uniform(random));
      for (std::size_t photo = 0; photo < 3; ++photo) {
        PhotoFeatures& features = photos_[photo];
        features.pixels.push_back(kWallCamera.Project(T_cam_world_[photo] * p_world) +
                                  Vector2d(noise_px(random), noise_px(random)));
        features.sigma_px.push_back(0.5);
        features.colours.push_back({});
      }
      for (PhotoPair& pair : pairs_) pair.matches.push_back({i, i});
    }
  }

  // Degrees by which the pose of the third photo is off; nothing where none was found.
  std::optional<double> Error_deg() const {
    PhotoScene scene(kWallCamera, photos_, pairs_, 1);
    scene.SetPose(0, T_cam_world_[0]);
    scene.SetPose(1, T_cam_world_[1]);
    scene.Triangulate();
    const std::optional<Pose> found = scene.FindPose(2, 30, 1);
    if (!found) return std::nullopt;
    return 180 / std::numbers::pi * found->rotation().angularDistance(T_cam_world_[2].rotation());
  }

 private:
  std::vector<Pose> T_cam_world_;
  std::vector<PhotoFeatures> photos_;
  std::vector<PhotoPair> pairs_;
};

TEST(PhotoScene, FindsNoPoseWhereABoardFarAwayLeavesTwoOpen) {
  int num_found = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::optional<double> error_deg = Board(0, seed).Error_deg();
    if (!error_deg) continue;
    ++num_found;
    EXPECT_LT(*error_deg, 20) << seed;  // 57 degrees apart
  }
  EXPECT_LT(num_found, 10);
}

TEST(PhotoScene, FindsThePoseWhereReliefLeavesOneOpen) {
  int num_found = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::optional<double> error_deg = Board(0.5, seed).Error_deg();
    if (!error_deg) continue;
    ++num_found;
    EXPECT_LT(*error_deg, 10) << seed;
  }
  EXPECT_EQ(num_found, 20);
}

TEST(MirroredPose, ShowsAPlaneFarAwayNearlyAlike) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vector3d> p_world;
  for (int i = 0; i < 50; ++i) p_world.emplace_back(uniform(random), uniform(random), 0);
  const double lean_rad = 0.4;
  const Pose pose(Eigen::Quaterniond(Eigen::AngleAxisd(lean_rad, Vector3d::UnitY())),
                  Vector3d(3, 2, 100));
  const Pose mirrored = MirroredPose(pose, p_world);
  EXPECT_NEAR(mirrored.rotation().angularDistance(pose.rotation()), 2 * lean_rad, 0.1);
  for (const Vector3d& p : p_world) {
    EXPECT_LT((kWallCamera.Project(mirrored * p) - kWallCamera.Project(pose * p)).norm(), 0.1);
  }
  EXPECT_LT(MirroredPose(mirrored, p_world).rotation().angularDistance(pose.rotation()), 1e-6);
}

TEST(MirroredPose, OfAPlaneStraightAheadIsTheSame) {
  const std::vector<Vector3d> p_world{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  const Pose pose(Eigen::Quaterniond::Identity(), Vector3d(0, 0, 10));
  const Pose mirrored = MirroredPose(pose, p_world);
  for (const Vector3d& p : p_world) EXPECT_LT((mirrored * p - pose * p).norm(), 1e-9);
}

}  // namespace
}  // namespace mono3d::tracking
