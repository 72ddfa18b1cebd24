// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/constraint_following.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono3d/geometry/similarity.h"
#include "reference/random.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/optimisation/map_constraints.h"
#include "tracking/optimisation/pose_constraint.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr KeyframeId kNum = 16;
constexpr double kFollowedHeight = 10;

// A straight flight over rough ground, each keyframe a fifth of the height from the one before: the
// first and the last see nothing together.
struct ConstrainedFlight {
  Map map{0, SmallCamera(), FeatureOptions{}};
  std::vector<Pose> truth;                 // T_cam_world
  std::vector<Similarity> S_tracker_true;  // around each keyframe
};

// The world as a tracker has it that is wrong by `step` from each keyframe to the next.
ConstrainedFlight Fly(const Similarity& step, std::mt19937& random) {
  ConstrainedFlight flight;
  Similarity drift;
  for (KeyframeId i = 0; i < kNum; ++i) {
    const Pose T_world_cam(Eigen::Quaterniond::Identity(), {2.0 * static_cast<double>(i), 0, 0});
    flight.truth.push_back(T_world_cam.Inverse());
    // About where the camera is.
    const Similarity to_camera(1, T_world_cam);
    drift = drift * to_camera * step * to_camera.Inverse();
    if (i == 0) drift = Similarity();
    flight.S_tracker_true.push_back(drift);
    View view;
    view.frame.index = static_cast<std::int64_t>(i);
    view.frame.camera = SmallCamera();
    view.T_cam_world = (drift * T_world_cam).Inverse();
    flight.map.AddKeyframe(view);
    flight.map.keyframe(i).id = 100 + static_cast<std::int64_t>(i);
    flight.map.keyframe(i).is_finalised = true;
  }
  for (int n = 0; n < 1000; ++n) {
    const Eigen::Vector3d p(Uniform(random, -5, 35), Uniform(random, -3, 3),
                            kFollowedHeight + Uniform(random, -2, 2));
    std::vector<KeyframeId> seeing;
    for (KeyframeId i = 0; i < kNum; ++i) {
      if (SmallCamera().Contains(SmallCamera().Project(flight.truth[i] * p))) seeing.push_back(i);
    }
    if (seeing.size() < 3) continue;
    const PointId point = flight.map.AddPoint(flight.S_tracker_true[seeing[seeing.size() / 2]] * p);
    for (const KeyframeId i : seeing) {
      Feature feature;
      feature.pixel = SmallCamera().Project(flight.truth[i] * p) +
                      Eigen::Vector2d(Normal(random, 0.3), Normal(random, 0.3));
      flight.map.AddObservation(point, i, feature);
    }
    flight.map.UpdateGeometry(point);
  }
  return flight;
}

// What a registration would say that is off by `error`.
KeyframeConstraint BetweenKeyframes(const ConstrainedFlight& flight, KeyframeId keyframe,
                                    KeyframeId anchor, const Pose& error = {}) {
  constexpr double kSigma = 1e-3;  // rad: a third of a pixel
  const double around_anchor = flight.S_tracker_true[anchor].scale();
  const Pose T = error * flight.truth[keyframe] * flight.truth[anchor].Inverse();
  KeyframeConstraint constraint;
  constraint.id = 100 + static_cast<std::int64_t>(keyframe);
  constraint.anchor_id = 100 + static_cast<std::int64_t>(anchor);
  constraint.T_cam_anchor = Pose(T.rotation(), around_anchor * T.translation());
  constraint.scale = around_anchor / flight.S_tracker_true[keyframe].scale();
  Vector7d sigma;
  sigma << Eigen::Vector3d::Constant(kSigma), Eigen::Vector3d::Constant(kSigma * kFollowedHeight),
      kSigma;
  constraint.information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  return constraint;
}

// Of the camera centres after the best similarity, root mean square, su.
double TrajectoryError(const ConstrainedFlight& flight, const Map& map) {
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> truth;
  // Beside the centres, which lie on a line, the points at which the cameras look.
  for (KeyframeId i = 0; i < kNum; ++i) {
    const double scale = flight.S_tracker_true[0].scale();
    for (const double z : {0.0, kFollowedHeight}) {
      estimated.push_back(map.T_cam_world(i).Inverse() * Eigen::Vector3d(0, 0, scale * z));
      truth.push_back(flight.truth[i].Inverse() * Eigen::Vector3d(0, 0, z));
    }
  }
  const Similarity S = FitSimilarity(estimated, truth);
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); i += 2) {
    sum += (S * estimated[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / kNum);
}

const Similarity kFollowedDrift(1.001, Pose(RotationExp({0.0006, -0.0004, 0.0005}), {0, 0, 0}));

// What `tell`, which moves the map of a flight that has drifted, makes of its error: less, in the
// mean of some flights. Both ends are right then; in between the noise of the points remains.
template <typename Tell>
void ExpectBetterThanWithout(const Tell& tell) {
  constexpr double kBetter = 0.67;
  constexpr int kNumFlights = 10;
  std::mt19937 random(SeedFromTestName());
  double error = 0;
  double error_without = 0;
  for (int i = 0; i < kNumFlights; ++i) {
    ConstrainedFlight flight = Fly(kFollowedDrift, random);
    Map without = flight.map;
    AdjustAll(without);
    error_without += TrajectoryError(flight, without);
    tell(flight);
    error += TrajectoryError(flight, flight.map);
  }
  EXPECT_LT(error, kBetter * error_without);
}

TEST(FollowConstraints, TakesTheDriftAwayThatAdjustmentCannotSee) {
  ExpectBetterThanWithout([](ConstrainedFlight& flight) {
    ASSERT_TRUE(AddConstraint(flight.map, BetweenKeyframes(flight, kNum - 1, 0)));
    const double contradiction =
        Contradiction(flight.map, AtPresent(flight.map, flight.map.constraints()[0]));
    MappingLock alone;
    EXPECT_TRUE(FollowConstraints(flight.map, alone));
    ASSERT_EQ(flight.map.constraints().size(), 1U);
    // It is satisfied, and noted.
    const PresentConstraint now = AtPresent(flight.map, flight.map.constraints()[0]);
    EXPECT_LT(Contradiction(flight.map, now), 0.05 * contradiction);
    EXPECT_NEAR(flight.map.keyframe(kNum - 1).scale, 1 / flight.S_tracker_true.back().scale(),
                0.005);
  });
}

TEST(FollowConstraints, LeavesTheMapToTheBitWhereAConstraintCannotBe) {
  for (const KeyframeId anchor : {kNum - 3, KeyframeId{0}}) {
    std::mt19937 random(SeedFromTestName());
    ConstrainedFlight flight = Fly(Similarity(), random);
    // A registration on the wrong roof: a tenth of the image over few keyframes, three over many.
    const double off = anchor == 0 ? 3 : 1;
    const Pose wrong(RotationExp({0, 0, 0.02}), {off, 0.3 * off, 0});
    AddConstraint(flight.map, BetweenKeyframes(flight, kNum - 1, anchor, wrong));
    const Map before = flight.map;
    MappingLock alone;
    EXPECT_FALSE(FollowConstraints(flight.map, alone));
    EXPECT_TRUE(flight.map.constraints().empty());
    for (KeyframeId i = 0; i < kNum; ++i) {
      EXPECT_EQ(flight.map.T_cam_world(i).Matrix(), before.T_cam_world(i).Matrix());
    }
  }
}

TEST(FollowConstraints, DoesNotLoseItByOneThatIsWrongByLittle) {
  ExpectBetterThanWithout([](ConstrainedFlight& flight) {
    AddConstraint(flight.map, BetweenKeyframes(flight, kNum - 1, 0));
    // Two sigmas of the graph's edges between keyframes that see points together.
    const Pose by_little(RotationExp({0, 0, 0.003}), {0.03, 0, 0});
    AddConstraint(flight.map, BetweenKeyframes(flight, 9, 7, by_little));
    MappingLock alone;
    FollowConstraints(flight.map, alone);
  });
}

TEST(FollowConstraints, KeepsWhatTheMapAgreesWithAndDoesNotMove) {
  std::mt19937 random(SeedFromTestName());
  ConstrainedFlight flight = Fly(Similarity(), random);
  AddConstraint(flight.map, BetweenKeyframes(flight, 5, 2));
  const Map before = flight.map;
  MappingLock alone;
  EXPECT_FALSE(FollowConstraints(flight.map, alone));
  EXPECT_EQ(flight.map.constraints().size(), 1U);
  EXPECT_EQ(flight.map.T_cam_world(5).Matrix(), before.T_cam_world(5).Matrix());
}

TEST(FollowConstraints, GivesTheSameBitsTwice) {
  const auto run = [] {
    std::mt19937 random(1);
    ConstrainedFlight flight = Fly(kFollowedDrift, random);
    AddConstraint(flight.map, BetweenKeyframes(flight, kNum - 1, 0));
    MappingLock alone;
    FollowConstraints(flight.map, alone);
    return flight.map.T_cam_world(kNum - 1).Matrix();
  };
  EXPECT_EQ(run(), run());
}

TEST(AddConstraint, RefusesKeyframesThatTheMapHasNotHandedOut) {
  std::mt19937 random(SeedFromTestName());
  ConstrainedFlight flight = Fly(Similarity(), random);
  KeyframeConstraint unknown = BetweenKeyframes(flight, 5, 2);
  unknown.anchor_id = 7;
  EXPECT_FALSE(AddConstraint(flight.map, unknown));
  flight.map.keyframe(5).is_finalised = false;
  EXPECT_FALSE(AddConstraint(flight.map, BetweenKeyframes(flight, 5, 2)));
  EXPECT_TRUE(flight.map.constraints().empty());
}

// The same contradiction after the map has grown, and with the keyframes that stand for culled
// ones.
TEST(AtPresent, FollowsLengthsAndCulledKeyframes) {
  std::mt19937 random(SeedFromTestName());
  ConstrainedFlight flight = Fly(Similarity(), random);
  AddConstraint(
      flight.map,
      BetweenKeyframes(flight, 9, 4, Pose(RotationExp({0, 0.002, 0.001}), {0.02, 0, -0.03})));
  const MapConstraint& constraint = flight.map.constraints()[0];
  const double before = Contradiction(flight.map, AtPresent(flight.map, constraint));
  ASSERT_GT(before, 1);
  std::vector<KeyframeId> keyframes;
  std::vector<Similarity> S_cam_world;
  for (KeyframeId i = 0; i < kNum; ++i) {
    keyframes.push_back(i);
    S_cam_world.push_back(Similarity(1, flight.map.T_cam_world(i)) * Similarity(0.5, Pose()));
  }
  flight.map.Correct(keyframes, S_cam_world);  // twice as large
  EXPECT_NEAR(Contradiction(flight.map, AtPresent(flight.map, constraint)), before, 1e-6 * before);
  flight.map.RemoveKeyframe(9, 8);
  flight.map.RemoveKeyframe(4, 3);
  const PresentConstraint present = AtPresent(flight.map, constraint);
  EXPECT_EQ(present.keyframe, 8U);
  EXPECT_EQ(present.anchor, 3U);
  // Equal but for the curvature of turns.
  EXPECT_NEAR(Contradiction(flight.map, present), before, 0.02 * before);
}

}  // namespace
}  // namespace mono3d::tracking
