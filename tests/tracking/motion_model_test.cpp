// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_model.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace mono3d::tracking
