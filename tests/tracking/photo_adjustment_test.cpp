// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace mono3d::tracking {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr CameraModel kPhotoCamera{
    .width = 800, .height = 600, .fx = 700, .fy = 700, .cx = 399.5, .cy = 299.5};

// What 60 photos from 40 m up show of rough ground; the map has lengths of 25 m.
struct Survey {
  std::vector<Pose> T_metric_cam;
  std::vector<Vector3d> p_m;
  SparseModel map;
  CameraPositions positions;
};

// A block of photos is bent by what a lens that is not known well makes of it: a bowl of this depth
// at its border.
Vector3d Bent(const Vector3d& p_m, double depth_m) {
  constexpr double kHalf_m = 60;
  const Vector3d from_middle = p_m - Vector3d(45, 25, 0);
  return p_m + Vector3d(0, 0, depth_m * from_middle.head<2>().squaredNorm() / (kHalf_m * kHalf_m));
}

Survey MakeSurvey(double bowl_m) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  Survey survey;
  for (int i = 0; i < 60; ++i) {
    const Vector3d eye(10.0 * (i % 10), 10.0 * (i / 10), 40 + 2 * uniform(random));
    const Eigen::Quaterniond down = RotationExp({std::numbers::pi, 0, 0});
    const double heading = (i / 10) % 2 == 0 ? 0 : std::numbers::pi;
    survey.T_metric_cam.emplace_back(RotationExp({0, 0, heading}) * down, eye);
  }
  for (int i = 0; i < 900; ++i) {
    survey.p_m.emplace_back(130 * uniform(random) - 20, 90 * uniform(random) - 20,
                            3 * uniform(random));
  }
  const Similarity S_map_metric = Similarity(1 / 25.0, survey.T_metric_cam.front().Inverse());
  survey.map.camera = kPhotoCamera;
  for (const Vector3d& p_m : survey.p_m) {
    survey.map.points.push_back({S_map_metric * Bent(p_m, bowl_m)});
  }
  for (std::size_t i = 0; i < survey.T_metric_cam.size(); ++i) {
    const Pose& T_metric_cam = survey.T_metric_cam[i];
    SparseImage& image = survey.map.images.emplace_back();
    image.id = static_cast<std::int64_t>(10 * i);
    image.T_world_cam =
        S_map_metric * Pose(T_metric_cam.rotation(), Bent(T_metric_cam.translation(), bowl_m));
    for (std::size_t k = 0; k < survey.p_m.size(); ++k) {
      const Vector3d p_cam = T_metric_cam.Inverse() * survey.p_m[k];
      const Vector2d pixel =
          kPhotoCamera.Project(p_cam) + 0.2 * Vector2d(normal(random), normal(random));
      if (kPhotoCamera.Contains(pixel)) image.observations.push_back({pixel, k});
    }
    CameraPosition position;
    position.frame_index = image.id;
    position.sigma_m = {0.02, 0.02, 0.03};
    position.p_m =
        T_metric_cam.translation() +
        position.sigma_m.cwiseProduct(Vector3d(normal(random), normal(random), normal(random)));
    survey.positions.positions.push_back(position);
  }
  survey.positions.S_metric_map = S_map_metric.Inverse();
  survey.positions.map_id = 3;
  return survey;
}

// Places that are known to 2 cm, marked to half a pixel.
void AddSurveyedPoints(Survey& survey) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (const Vector2d& at : {Vector2d(0, 0), Vector2d(90, 0), Vector2d(0, 50), Vector2d(90, 50),
                             Vector2d(45, 25), Vector2d(20, 30)}) {
    KnownPoint point;
    const Vector3d p_m(at.x(), at.y(), 1);
    point.p_m = p_m + 0.02 * Vector3d(normal(random), normal(random), normal(random));
    point.sigma_m = Vector3d::Constant(0.02);
    for (std::size_t i = 0; i < survey.T_metric_cam.size(); ++i) {
      const Vector3d p_cam = survey.T_metric_cam[i].Inverse() * p_m;
      const Vector2d pixel =
          kPhotoCamera.Project(p_cam) + 0.5 * Vector2d(normal(random), normal(random));
      if (!kPhotoCamera.Contains(pixel)) continue;
      point.sights.push_back({static_cast<std::int64_t>(10 * i), kPhotoCamera.Unproject(pixel),
                              0.5 / kPhotoCamera.fx});
    }
    survey.positions.points.push_back(point);
  }
}

// Of those that four images show; what fewer show at the border says nothing of the block.
double RmsOfPoints(const Survey& survey) {
  constexpr int kFewest = 4;
  std::vector<int> num_seen(survey.p_m.size(), 0);
  for (const SparseImage& image : survey.map.images) {
    for (const SparseObservation& seen : image.observations) ++num_seen[*seen.point];
  }
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < survey.p_m.size(); ++i) {
    if (num_seen[i] < kFewest) continue;
    sum += (survey.positions.S_metric_map * survey.map.points[i].p_world - survey.p_m[i])
               .squaredNorm();
    ++count;
  }
  return std::sqrt(sum / count);
}

double RmsOfCameras(const Survey& survey) {
  double sum = 0;
  for (std::size_t i = 0; i < survey.map.images.size(); ++i) {
    sum += (survey.positions.S_metric_map * survey.map.images[i].T_world_cam.translation() -
            survey.T_metric_cam[i].translation())
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(survey.map.images.size()));
}

TEST(AdjustToEarth, PositionsTakeTheBowlOutOfABlock) {
  Survey survey = MakeSurvey(3);
  EXPECT_GT(RmsOfPoints(survey), 1);
  const Pose first = survey.map.images.front().T_world_cam;
  const double scale = survey.positions.S_metric_map.scale();
  const auto fit = AdjustToEarth(survey.map, survey.positions);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->map_id, 3);
  EXPECT_EQ(fit->num_used, 60U);
  EXPECT_EQ(fit->num_outliers, 0U);
  EXPECT_GT(fit->rms_moved_m, 0.5);
  // The positions alone are off by 4.1 cm (2, 2 and 3); the images can only make that less. Points
  // are seen to 0.2 px, 1.1 cm.
  EXPECT_LT(RmsOfCameras(survey), 0.041);
  EXPECT_LT(RmsOfPoints(survey), 0.08);
  EXPECT_LT((survey.map.images.front().T_world_cam.translation() - first.translation()).norm(),
            1e-9);
  EXPECT_LT((survey.map.images.front().T_world_cam.Inverse() * first).RotationAngle(), 1e-7);
  EXPECT_NEAR(survey.positions.S_metric_map.scale(), scale, 1e-9);
}

TEST(AdjustToEarth, KnownPointsTakeTheBowlOutOfABlock) {
  Survey survey = MakeSurvey(3);
  survey.positions.positions.clear();
  AddSurveyedPoints(survey);
  const auto fit = AdjustToEarth(survey.map, survey.positions);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->num_points_used, 6U);
  EXPECT_EQ(fit->num_point_outliers, 0U);
  // Six points of 2 cm, heights at the border from further out than they are.
  EXPECT_LT(RmsOfPoints(survey), 0.1);
}

TEST(AdjustToEarth, PositionsThatAreFarOffDoNotCount) {
  Survey survey = MakeSurvey(1);
  for (const std::size_t i : {7U, 31U, 44U}) {
    survey.positions.positions[i].p_m += Vector3d(9, -12, 20);
  }
  const auto fit = AdjustToEarth(survey.map, survey.positions);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->num_outliers, 3U);
  EXPECT_LT(RmsOfCameras(survey), 0.041);
}

TEST(AdjustToEarth, WithTooLittleNothingMoves) {
  Survey survey = MakeSurvey(1);
  survey.positions.positions.resize(2);
  const SparseModel before = survey.map;
  EXPECT_FALSE(AdjustToEarth(survey.map, survey.positions).has_value());
  EXPECT_EQ(survey.map.points[3].p_world, before.points[3].p_world);
  survey.map = {};
  EXPECT_FALSE(AdjustToEarth(survey.map, survey.positions).has_value());
}

}  // namespace
}  // namespace mono3d::tracking
