// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/trajectory_error.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

// Double precision, through a singular value decomposition.
constexpr double kRounding = 1e-9;

Eigen::Quaterniond Turn(double angle_deg, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(
      Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180, axis.normalized()));
}

StampedPose At(double time_s, double x, double y, double z) {
  return {time_s, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, y, z))};
}

TrajectoryErrorOptions Align(const std::string& align) {
  TrajectoryErrorOptions options;
  options.align = align;
  return options;
}

std::vector<StampedPose> Moved(const Similarity& S, std::vector<StampedPose> poses) {
  for (StampedPose& pose : poses) pose.T_world_cam = S * pose.T_world_cam;
  return poses;
}

// A winding flight that turns as it goes.
std::vector<StampedPose> Flight(int num_poses) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < num_poses; ++i) {
    const double t = 0.1 * i;
    poses.push_back({t, Pose(Turn(20 * t, {1, 2, 3}),
                             Eigen::Vector3d(3 * std::cos(t), 2 * t, std::sin(2 * t)))});
  }
  return poses;
}

// Four corners of a square and its middle; the estimate has the middle 1 too high.
const std::vector<StampedPose> kSquare = {At(0, 1, 1, 0), At(1, 1, -1, 0), At(2, -1, -1, 0),
                                          At(3, -1, 1, 0), At(4, 0, 0, 0)};
const std::vector<StampedPose> kRaised = {At(0, 1, 1, 0), At(1, 1, -1, 0), At(2, -1, -1, 0),
                                          At(3, -1, 1, 0), At(4, 0, 0, 1)};

TEST(TrajectoryError, OfFivePosesAsTheyStandIsThatWorkedOutByHand) {
  const TrajectoryError error = CompareTrajectories(kRaised, kSquare, Align("none"));
  // Errors 0, 0, 0, 0, 1.
  EXPECT_EQ(error.position.count, 5);
  EXPECT_NEAR(error.position.rmse, std::sqrt(0.2), kRounding);
  EXPECT_NEAR(error.position.mean, 0.2, kRounding);
  EXPECT_NEAR(error.position.median, 0, kRounding);
  EXPECT_NEAR(error.position.sigma, 0.4, kRounding);  // sqrt((4 * 0.04 + 0.64) / 5)
  EXPECT_NEAR(error.position.max, 1, kRounding);
  EXPECT_NEAR(error.path_length, 6 + std::sqrt(2), kRounding);
  EXPECT_EQ(error.truth_coverage, 1);
}

TEST(TrajectoryError, OfFivePosesAlignedRigidlyIsThatWorkedOutByHand) {
  const TrajectoryError error = CompareTrajectories(kRaised, kSquare, Align("se3"));
  // The mean of the estimate, (0, 0, 0.2), moves to the origin: errors 0.2 four times and 0.8.
  EXPECT_NEAR(error.position.rmse, 0.4, kRounding);  // sqrt((4 * 0.04 + 0.64) / 5)
  EXPECT_NEAR(error.position.mean, 0.32, kRounding);
  EXPECT_NEAR(error.position.median, 0.2, kRounding);
  EXPECT_NEAR(error.position.sigma, 0.24, kRounding);  // sqrt((4 * 0.0144 + 0.2304) / 5)
  EXPECT_NEAR(error.position.max, 0.8, kRounding);
  EXPECT_NEAR(error.S_truth_estimate.scale(), 1, kRounding);
  EXPECT_TRUE(
      error.S_truth_estimate.pose().translation().isApprox(Eigen::Vector3d(0, 0, -0.2), kRounding));
}

TEST(TrajectoryError, OfFivePosesAlignedWithScaleIsThatWorkedOutByHand) {
  const TrajectoryError error = CompareTrajectories(kRaised, kSquare, Align("sim3"));
  // Umeyama: scale = trace(D) / variance of the estimate = 8 / (8 + 4 * 0.04 + 0.64) = 10 / 11.
  EXPECT_NEAR(error.S_truth_estimate.scale(), 10.0 / 11, kRounding);
  // Corners: 1/11 short in x and y, and 0.2 * 10/11 = 2/11 low: sqrt(1 + 1 + 4) / 11. Middle: 8/11.
  EXPECT_NEAR(error.position.max, 8.0 / 11, kRounding);
  EXPECT_NEAR(error.position.median, std::sqrt(6.0) / 11, kRounding);
  EXPECT_NEAR(error.position.mean, (4 * std::sqrt(6.0) + 8) / 55, kRounding);
  EXPECT_NEAR(error.position.rmse, std::sqrt((4 * 6 + 64) / 5.0) / 11, kRounding);
}

TEST(TrajectoryError, VanishesForATruthMovedByASimilarity) {
  const std::vector<StampedPose> truth = Flight(40);
  const Similarity S(0.013, Pose(Turn(100, {3, -1, 2}), Eigen::Vector3d(50, -20, 7)));
  const TrajectoryError error = CompareTrajectories(Moved(S, truth), truth);
  EXPECT_LT(error.position.max, kRounding);
  EXPECT_LT(error.rotation_deg.max, 1e-6);  // degrees
  EXPECT_LT(error.relative_position.max, kRounding);
  EXPECT_NEAR(error.S_truth_estimate.scale() * S.scale(), 1, kRounding);
}

TEST(TrajectoryError, DoesNotDependOnTheScaleOfTheEstimate) {
  const std::vector<StampedPose> truth = Flight(40);
  std::vector<StampedPose> estimate = truth;
  estimate[7].T_world_cam = Pose(Turn(4, {0, 1, 0}), Eigen::Vector3d(3, 1, 1));
  const Similarity S(1000, Pose(Turn(33, {1, 1, 0}), Eigen::Vector3d(1, 2, 3)));
  const TrajectoryError error = CompareTrajectories(estimate, truth);
  const TrajectoryError scaled = CompareTrajectories(Moved(S, estimate), truth);
  EXPECT_NEAR(scaled.position.rmse, error.position.rmse, kRounding);
  EXPECT_NEAR(scaled.relative_position.mean, error.relative_position.mean, kRounding);
  EXPECT_GT(error.position.rmse, 0.01);
}

TEST(TrajectoryError, OfRotationIsTheAngleLeft) {
  const std::vector<StampedPose> truth = Flight(10);
  std::vector<StampedPose> estimate = truth;
  for (StampedPose& pose : estimate) {
    pose.T_world_cam = pose.T_world_cam * Pose(Turn(3, {0, 0, 1}), Eigen::Vector3d::Zero());
  }
  const TrajectoryError error = CompareTrajectories(estimate, truth);
  EXPECT_NEAR(error.rotation_deg.mean, 3, 1e-6);
  EXPECT_NEAR(error.rotation_deg.sigma, 0, 1e-6);
}

TEST(TrajectoryError, RelativeToThePathIsThatOfAConstantDrift) {
  // Ten steps of 1; the estimate drifts sideways by 0.02 a step: 2 % of every segment.
  std::vector<StampedPose> truth;
  std::vector<StampedPose> estimate;
  for (int i = 0; i <= 10; ++i) {
    truth.push_back(At(i, i, 0, 0));
    estimate.push_back(At(i, i, 0.02 * i, 0));
  }
  TrajectoryErrorOptions options = Align("none");
  options.relative_segment = 0.3;
  const TrajectoryError error = CompareTrajectories(estimate, truth, options);
  EXPECT_EQ(error.relative_position.count, 8);  // of length 3, begun at 0 to 7
  EXPECT_NEAR(error.relative_position.mean, 0.02, kRounding);
  EXPECT_NEAR(error.relative_position.max, 0.02, kRounding);
}

TEST(TrajectoryError, OfAStraightFlightTakesTheRollFromTheOrientations) {
  std::vector<StampedPose> truth;
  for (int i = 0; i < 10; ++i) {
    truth.push_back({0.1 * i, Pose(Turn(5 * i, {0, 1, 1}), Eigen::Vector3d(2 * i, i, 0))});
  }
  const Similarity S(3, Pose(Turn(140, {2, 1, 0.3}), Eigen::Vector3d(5, 6, 7)));
  const TrajectoryError error = CompareTrajectories(Moved(S, truth), truth);
  EXPECT_TRUE(error.is_straight);
  EXPECT_LT(error.position.max, kRounding);
  EXPECT_LT(error.rotation_deg.max, 1e-5);
  EXPECT_FALSE(CompareTrajectories(Flight(10), Flight(10)).is_straight);
}

TEST(TrajectoryError, OfANearlyStraightFlightTakesTheRollFromTheOrientations) {
  // Along x, swaying by 0.2 to the sides; the estimate errs by half of that, up and down.
  std::vector<StampedPose> truth;
  std::vector<StampedPose> estimate;
  for (int i = 0; i < 40; ++i) {
    const double sway = 0.2 * std::sin(0.7 * i);
    truth.push_back({0.1 * i, Pose(Turn(30, {1, 2, 0}), Eigen::Vector3d(i, sway, 0))});
    estimate.push_back(truth.back());
    const Eigen::Vector3d wrong(0, 0, 0.5 * sway);
    estimate.back().T_world_cam =
        Pose(Turn(30, {1, 2, 0}), truth.back().T_world_cam.translation() + wrong);
  }
  // By positions alone it would be rolled by atan(1 / 2).
  const TrajectoryError error = CompareTrajectories(estimate, truth);
  EXPECT_TRUE(error.is_straight);
  EXPECT_LT(error.rotation_deg.max, 0.5);
}

TEST(TrajectoryError, OfANearlyStraightFlightBelievesTheOrientationsNoMoreThanThePositionsAllow) {
  // Swaying by 1; the estimate errs by a hundredth: the positions are sure of the roll to a degree.
  const auto compare = [](double roll_deg) {
    std::vector<StampedPose> truth;
    std::vector<StampedPose> estimate;
    for (int i = 0; i < 80; ++i) {
      const double sway = std::sin(0.7 * i);
      truth.push_back({0.1 * i, Pose(Turn(30, {1, 2, 0}), Eigen::Vector3d(i, sway, 0))});
      const Eigen::Vector3d wrong(0, 0, 0.01 * std::cos(1.9 * i));
      estimate.push_back({0.1 * i, Pose(Turn(roll_deg, {1, 0, 0}) * Turn(30, {1, 2, 0}),
                                        truth.back().T_world_cam.translation() + wrong)});
    }
    return CompareTrajectories(estimate, truth);
  };
  EXPECT_TRUE(compare(0.5).is_straight);
  EXPECT_LT(compare(0.5).rotation_deg.max, 0.1);
  EXPECT_FALSE(compare(5).is_straight);
  EXPECT_GT(compare(5).rotation_deg.min, 4);
}

std::vector<std::pair<std::size_t, std::size_t>> Pairs(const std::vector<double>& estimate,
                                                       const std::vector<double>& truth) {
  std::vector<StampedPose> estimated_poses;
  std::vector<StampedPose> true_poses;
  for (const double time : estimate) estimated_poses.push_back(At(time, 0, 0, 0));
  for (const double time : truth) true_poses.push_back(At(time, 0, 0, 0));
  TrajectoryErrorOptions options = Align("none");
  options.max_time_difference_s = 0.1;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& pose : CompareTrajectories(estimated_poses, true_poses, options).poses) {
    pairs.emplace_back(pose.estimate_index, pose.truth_index);
  }
  return pairs;
}

TEST(TrajectoryError, AssociatesEachPoseWithTheNearestInTime) {
  EXPECT_THAT(Pairs({0.04, 1.06, 2.2}, {0, 1, 1.1, 2}),
              ElementsAre(std::pair(0, 0), std::pair(1, 2)));
}

TEST(TrajectoryError, AssociatesOneToOne) {
  // Both are nearest to 1, and 1.01 is nearer.
  EXPECT_THAT(Pairs({0.95, 1.01}, {0, 1, 2}), ElementsAre(std::pair(1, 1)));
  EXPECT_THAT(Pairs({0, 1, 2}, {0.95, 1.01}), ElementsAre(std::pair(1, 1)));
}

TEST(TrajectoryError, TakesPosesInAnyOrderOfTime) {
  EXPECT_THAT(Pairs({3, 1, 2}, {2, 3}), ElementsAre(std::pair(2, 0), std::pair(0, 1)));
}

TEST(TrajectoryError, StatesTheShareOfTheTruthThatIsCovered) {
  const std::vector<StampedPose> truth = Flight(40);
  const std::vector<StampedPose> estimate(truth.begin(), truth.begin() + 10);
  const TrajectoryError error = CompareTrajectories(estimate, truth);
  EXPECT_EQ(error.truth_coverage, 0.25);
  EXPECT_EQ(error.num_estimated, 10);
  EXPECT_EQ(error.num_true, 40);
}

TEST(TrajectoryError, RefusesTooFewAssociatedPoses) {
  std::vector<StampedPose> late = Flight(5);
  for (StampedPose& pose : late) pose.timestamp_s += 0.34;
  EXPECT_THAT([&] { CompareTrajectories(late, Flight(5)); },
              ThrowsMessage<Error>(HasSubstr(
                  "too few poses with a true pose of the same time (expected 3 or more within 0.01 "
                  "s, found 0 of 5 estimated and 5 true poses)")));
  EXPECT_THROW(CompareTrajectories(Flight(2), Flight(2)), Error);
  EXPECT_THROW(CompareTrajectories({}, Flight(2), Align("none")), Error);
}

TEST(TrajectoryError, RefusesACameraThatStandsStill) {
  const std::vector<StampedPose> still = {At(0, 1, 2, 3), At(0.1, 1, 2, 3), At(0.2, 1, 2, 3)};
  EXPECT_THAT([&] { CompareTrajectories(still, Flight(3)); },
              ThrowsMessage<Error>(HasSubstr("found estimated positions all in one place")));
  EXPECT_THAT([&] { CompareTrajectories(Flight(3), still); },
              ThrowsMessage<Error>(HasSubstr("found true positions all in one place")));
  EXPECT_EQ(CompareTrajectories(still, still, Align("none")).relative_position.count, 0);
}

TEST(TrajectoryError, RefusesBadOptions) {
  EXPECT_THROW(CompareTrajectories(kSquare, kSquare, Align("sim2")), UsageError);
  TrajectoryErrorOptions options;
  options.max_time_difference_s = -1;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.relative_segment = 0;
  EXPECT_THROW(options.Validate(), UsageError);
}

}  // namespace
}  // namespace mono3d
