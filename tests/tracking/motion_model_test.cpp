// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mono3d::tracking {
namespace {

constexpr double kMotionTolerance = 1e-12;

const Pose& Step() {
  static const Pose step(RotationExp({0.1, -0.2, 0.3}), Eigen::Vector3d(1, 2, -1));
  return step;
}

TEST(ScaleMotion, DoublesRotationAndTranslation) {
  const Pose twice = ScaleMotion(Step(), 2);
  EXPECT_LT((RotationLog(twice.rotation()) - Eigen::Vector3d(0.2, -0.4, 0.6)).norm(),
            kMotionTolerance);
  EXPECT_LT((twice.translation() - Eigen::Vector3d(2, 4, -2)).norm(), kMotionTolerance);
}

TEST(MotionModel, KnowsNothingAtFirstAndAfterAReset) {
  MotionModel motion;
  EXPECT_FALSE(motion.Predict(1).has_value());
  motion.Rescale(2);  // nothing to scale
  motion.Add(Step(), 0.1);
  ASSERT_TRUE(motion.last().has_value());
  motion.Reset();
  EXPECT_FALSE(motion.last().has_value());
  EXPECT_FALSE(motion.Predict(1).has_value());
}

TEST(MotionModel, PredictsConstantVelocityOverFramesLeftOut) {
  MotionModel motion;
  motion.Add(Step(), 0.1);
  EXPECT_LT((motion.Predict(0.1)->Matrix() - Step().Matrix()).norm(), kMotionTolerance);
  EXPECT_LT((motion.Predict(0.3)->Matrix() - ScaleMotion(Step(), 3).Matrix()).norm(),
            kMotionTolerance);
}

TEST(MotionModel, RepeatsTheMotionWhereTimeStandsStill) {
  MotionModel motion;
  motion.Add(Step(), 0);
  EXPECT_LT((motion.Predict(0.3)->Matrix() - Step().Matrix()).norm(), kMotionTolerance);
}

TEST(MotionModel, TakesTheLengthsOfTheWorldAlong) {
  MotionModel motion;
  motion.Add(Step(), 0.1);
  motion.Rescale(2);
  EXPECT_EQ(motion.last()->translation(), Eigen::Vector3d(2, 4, -2));
  EXPECT_EQ(motion.last()->rotation().coeffs(), Step().rotation().coeffs());
}

// A camera that shakes at 4 Hz about two axes, at 30 frames a second.
Pose ShakingPose(double t_s) {
  const double shake = 0.02 * std::sin(25 * t_s);
  return {RotationExp({shake, 0.5 * t_s, 0.5 * shake}), Eigen::Vector3d(t_s, shake, 0)};
}

CameraVelocity TrueVelocity(double t_s) {
  constexpr double kStep_s = 1e-4;
  return VelocityOf(ShakingPose(t_s + kStep_s) * ShakingPose(t_s - kStep_s).Inverse(), 2 * kStep_s);
}

MotionModel FollowShaking(int num_frames, double frames_per_s = 30) {
  MotionModel motion;
  for (int i = 1; i < num_frames; ++i) {
    motion.Add(ShakingPose(i / frames_per_s) * ShakingPose((i - 1) / frames_per_s).Inverse(),
               1 / frames_per_s);
  }
  return motion;
}

double AngularError(const VelocityPrior& found, double t_s) {
  return (found.mean.angular_rad_per_s - TrueVelocity(t_s).angular_rad_per_s).norm();
}

TEST(MotionModel, FollowsAShakeByTwoFramesOnEachSide) {
  double sum_at_end = 0;
  double sum_between_two = 0;
  double sum_between_four = 0;
  for (int num_frames = 10; num_frames < 40; ++num_frames) {
    const MotionModel motion = FollowShaking(num_frames);
    const double last_s = (num_frames - 1) / 30.;
    sum_at_end += AngularError(motion.Velocity(0), last_s);
    sum_between_two += AngularError(motion.Velocity(1), last_s - 1 / 30.);
    sum_between_four += AngularError(motion.Velocity(2), last_s - 2 / 30.);
    EXPECT_GT(motion.Velocity(0).angular_sigma_rad_per_s, 0);
  }
  const double amplitude = 0.02 * 25;
  EXPECT_LT(sum_between_four / 30, 0.03 * amplitude);
  EXPECT_LT(sum_between_four, 0.5 * sum_between_two);
  EXPECT_LT(sum_between_two, 0.5 * sum_at_end);
}

// A fifth of the frame rate, of which two frames on each side miss a fourteenth.
TEST(MotionModel, FollowsAFastShakeBySixFramesOnEachSide) {
  constexpr double kFramesPerS = 20;
  double sum_between_four = 0;
  double sum_between_twelve = 0;
  for (int num_frames = 14; num_frames < 44; ++num_frames) {
    const MotionModel motion = FollowShaking(num_frames, kFramesPerS);
    sum_between_four += AngularError(motion.Velocity(2), (num_frames - 3) / kFramesPerS);
    sum_between_twelve += AngularError(motion.Velocity(6), (num_frames - 7) / kFramesPerS);
  }
  const double amplitude = 0.02 * 25;
  EXPECT_LT(sum_between_twelve / 30, 0.005 * amplitude);
  EXPECT_GT(sum_between_four / 30, 0.03 * amplitude);
}

TEST(MotionModel, FollowsFramesMovedAfterwards) {
  MotionModel moved = FollowShaking(10);
  const Pose T_new_old(RotationExp({0, 0.01, 0}), Eigen::Vector3d(0.1, 0, 0));
  moved.Move(1, T_new_old);
  // There and back again.
  moved.Move(1, T_new_old.Inverse());
  EXPECT_LT(AngularError(moved.Velocity(1), 8 / 30.), AngularError(moved.Velocity(0), 9 / 30.));
  moved.Move(0, T_new_old);
  const Pose expected = T_new_old * *FollowShaking(10).last();
  EXPECT_LT((moved.last()->Matrix() - expected.Matrix()).norm(), 1e-9);
}

// As where images of a hovering drone are left out: it drifts, then flies off within a frame.
TEST(MotionModel, TakesNoVelocityThroughTimesOfAnotherOrder) {
  constexpr double kFrame_s = 1.0 / 30;
  constexpr double kDrift_su_per_s = 0.01;
  constexpr double kFlight_su_per_s = 1;
  const auto ahead = [](double way_su) {
    return Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -way_su));
  };
  MotionModel motion;
  for (int i = 0; i < 2; ++i) motion.Add(ahead(kDrift_su_per_s * 2), 2);
  const double drifting = motion.Velocity(1).mean.linear_su_per_s.z();
  for (int i = 0; i < 2; ++i) motion.Add(ahead(kFlight_su_per_s * kFrame_s), kFrame_s);
  EXPECT_NEAR(motion.Velocity(0).mean.linear_su_per_s.norm(), kFlight_su_per_s, 1e-9);
  // Between two drifts, with the flight behind the second one.
  EXPECT_NEAR(motion.Velocity(3).mean.linear_su_per_s.z(), drifting, 1e-9);
}

TEST(MotionModel, TakesWhatIsExpectedUntilThereIsAMotion) {
  MotionModel motion;
  motion.Expect(Step(), 0.1);
  EXPECT_LT((motion.Predict(0.2)->Matrix() - ScaleMotion(Step(), 2).Matrix()).norm(),
            kMotionTolerance);
  EXPECT_NEAR(motion.Velocity(0).mean.angular_rad_per_s.y(), -2, 1e-9);
  motion.Add(Pose(), 0.1);
  EXPECT_EQ(motion.Velocity(0).mean, CameraVelocity());
}

TEST(MotionModel, KnowsNoVelocityWhereTimeStandsStill) {
  MotionModel motion;
  EXPECT_EQ(motion.Velocity(0).mean, CameraVelocity());
  motion.Add(Step(), 0);
  EXPECT_EQ(motion.Velocity(0).mean, CameraVelocity());
  EXPECT_EQ(motion.Velocity(7).mean, CameraVelocity());
}

}  // namespace
}  // namespace mono3d::tracking
