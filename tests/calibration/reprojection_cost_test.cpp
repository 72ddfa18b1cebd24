// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/reprojection_cost.h"

#include <ceres/cost_function.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "calibration/camera_adjustment.h"
#include "calibration/camera_posterior.h"
#include "calibration/flow_cost.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d::calibration {
namespace {

CameraModel RollingCamera(LensModel lens) {
  CameraModel camera{640, 480, 560, 570, 324, 236, {-0.12, 0.05, 0.0004, -0.0003, 0.01}};
  camera.lens = lens;
  camera.shutter = {0.02, false};
  return camera;
}

CameraVelocity FastMotion() {
  CameraVelocity velocity;
  velocity.angular_rad_per_s = {0.4, -0.3, 0.7};
  velocity.angular_rad_per_s2 = {2, 3, -1};
  velocity.linear_su_per_s = {1, -2, 0.5};
  velocity.linear_su_per_s2 = {4, 1, -2};
  return velocity;
}

// A camera, a pose, a point and a velocity's change, one after the other.
constexpr int kNumUnknowns = kNumParameters + 6 + 3 + 6;
using Unknowns = Eigen::Matrix<double, kNumUnknowns, 1>;

struct Evaluated {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, kNumParameters, Eigen::RowMajor> by_camera;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_pose;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_point;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_velocity;
  bool is_in_front = false;
};

Evaluated EvaluateAt(const ceres::CostFunction& cost, const Unknowns& at) {
  Evaluated result;
  const double* of_pose = at.data() + kNumParameters;
  const std::array<const double*, 4> parameters = {at.data(), of_pose, of_pose + 6, of_pose + 9};
  std::array<double*, 4> jacobians = {result.by_camera.data(), result.by_pose.data(),
                                      result.by_point.data(), result.by_velocity.data()};
  result.is_in_front = cost.Evaluate(parameters.data(), result.residual.data(), jacobians.data());
  return result;
}

Unknowns SomeUnknowns(const CameraModel& camera, const Eigen::Vector3d& rotation) {
  Unknowns at;
  at << ToParameters(camera), rotation, 0.3, -0.2, 0.1, 1.5, -0.8, 4, 0.05, -0.1, 0.08, 0.3, 0.2,
      -0.4;
  return at;
}

class ReprojectionDerivatives : public testing::TestWithParam<LensModel> {};

void ExpectDerivativesOfDifferences(const ceres::CostFunction& cost, const CameraModel& camera) {
  for (const double turn : {0., 1e-6, 0.3}) {
    const Unknowns at = SomeUnknowns(camera, turn * Eigen::Vector3d(0.5, -0.7, 0.4));
    const Evaluated found = EvaluateAt(cost, at);
    ASSERT_TRUE(found.is_in_front);
    Eigen::Matrix<double, 2, kNumUnknowns> J;
    J << found.by_camera, found.by_pose, found.by_point, found.by_velocity;
    for (int i = 0; i < kNumUnknowns; ++i) {
      constexpr double kStep = 1e-6;
      Unknowns more = at;
      Unknowns less = at;
      more[i] += kStep;
      less[i] -= kStep;
      const Eigen::Vector2d expected =
          (EvaluateAt(cost, more).residual - EvaluateAt(cost, less).residual) / (2 * kStep);
      EXPECT_LT((J.col(i) - expected).norm(), 1e-5 * (1 + expected.norm()))
          << "unknown " << i << ", rotated by " << turn;
    }
  }
}

TEST_P(ReprojectionDerivatives, AreThoseOfDifferences) {
  const CameraModel camera = RollingCamera(GetParam());
  const CameraVelocity velocity = FastMotion();
  ExpectDerivativesOfDifferences(ReprojectionCost(camera, {500, 400}, 0.5, velocity), camera);
  ExpectDerivativesOfDifferences(FlowCost(camera.lens, {20, -30}, 7, velocity), camera);
}

// From the pixel at one line to that at another.
TEST_P(ReprojectionDerivatives, FlowIsThatBetweenTheLines) {
  const CameraModel camera = RollingCamera(GetParam());
  CameraVelocity velocity = FastMotion();
  velocity.angular_rad_per_s2.setZero();
  velocity.linear_su_per_s2.setZero();
  const Unknowns at = SomeUnknowns(camera, {0.15, -0.2, 0.1});
  const auto pixel_at = [&](double row) {
    const Eigen::Vector2d observed(500, row);
    return Eigen::Vector2d(
        EvaluateAt(ReprojectionCost(camera, observed, 1, velocity), at).residual + observed);
  };
  const double middle = 0.5 * (camera.height - 1);
  const double apart_s = camera.shutter.readout_s * 2 / (camera.height - 1);
  const Eigen::Vector2d flow = (pixel_at(middle + 1) - pixel_at(middle - 1)) / apart_s;
  const Eigen::Vector2d known(20, -30);
  const Evaluated found = EvaluateAt(FlowCost(camera.lens, known, 7, velocity), at);
  EXPECT_GT(flow.norm(), 50);
  EXPECT_LT((7 * found.residual - (flow - known)).norm(), 1e-3 * flow.norm());
}

TEST_P(ReprojectionDerivatives, GoWithTheModelOfTheCamera) {
  CameraModel camera = RollingCamera(GetParam());
  camera.shutter = {};
  const CameraVelocity velocity;
  const Eigen::Vector2d observed(500, 400);
  const ReprojectionCost cost(camera, observed, 0.5, velocity);
  const Unknowns at = SomeUnknowns(camera, Eigen::Vector3d::Zero());
  const Eigen::Vector3d p_cam =
      at.segment<3>(kNumParameters + 3) + at.segment<3>(kNumParameters + 6);
  const Eigen::Vector2d expected = (ProjectDistorted(camera, p_cam) - observed) / 0.5;
  EXPECT_LT((EvaluateAt(cost, at).residual - expected).norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Lenses, ReprojectionDerivatives,
                         testing::Values(LensModel::kBrown, LensModel::kFisheye));

TEST(ReprojectionCost, IsNoneBehindTheCamera) {
  const CameraModel camera = RollingCamera(LensModel::kBrown);
  const CameraVelocity velocity;
  Unknowns at = SomeUnknowns(camera, Eigen::Vector3d::Zero());
  at[kNumParameters + 8] = -4;
  EXPECT_FALSE(EvaluateAt(ReprojectionCost(camera, {500, 400}, 0.5, velocity), at).is_in_front);
  EXPECT_FALSE(EvaluateAt(FlowCost(camera.lens, {0, 0}, 1, velocity), at).is_in_front);
}

TEST(DifferenceOfRounds, AddsHalfItsSquareToWhatTheImagesDetermine) {
  CameraAdjustment before;
  before.camera = RollingCamera(LensModel::kBrown);
  CameraAdjustment now = before;
  now.camera.fx *= std::exp(0.01);
  now.camera.fy *= std::exp(0.01);
  now.camera.cx += 2;
  now.is_determined[kLogFocal] = true;
  now.covariance(kLogFocal, kLogFocal) = 1e-6;
  now = WithDifference(now, before);
  EXPECT_NEAR(now.covariance(kLogFocal, kLogFocal), 1e-6 + 0.5e-4, 1e-12);
  EXPECT_EQ(now.covariance(kCx, kCx), 0) << "has its prior's variance";
}

}  // namespace
}  // namespace mono3d::calibration
