// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The whole tracker, told of where its keyframes are to each other, in both modes.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

struct Told {
  std::size_t num_moved = 0;  // keyframes handed out before
  Pose T_claimed;             // of the newer keyframe in the camera of the older one
  Pose T_before;
  Pose T_after;
};

// To the bit. A pose times its inverse is not the identity to the last one.
bool AreEqual(const Pose& a, const Pose& b) {
  return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
}

// A flight at the end of which something claims that the last finalised keyframe is elsewhere to
// the first by `error`.
Told FlyAndTell(const Pose& error, const TrackerOptions& options) {
  static const Sequence flight = FlyOver(TexturedGround(true), 24);
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  std::vector<Keyframe> keyframes;
  for (const Frame& frame : flight.frames) {
    for (Keyframe& keyframe : tracker->Track(frame).finalised_keyframes) {
      keyframes.push_back(std::move(keyframe));
    }
  }
  tracker->WaitForMapping();
  const auto pose_of = [&](const Keyframe& keyframe) {
    for (const TrajectoryEntry& entry : tracker->KeyframeTrajectory()) {
      if (entry.frame_index == keyframe.frame.index) return entry.T_world_cam;
    }
    return Pose();
  };
  const Keyframe& anchor = keyframes.front();
  const Keyframe& last = keyframes.back();
  Told told;
  told.T_before = pose_of(anchor).Inverse() * pose_of(last);
  KeyframeConstraint constraint;
  constraint.id = last.id;
  constraint.anchor_id = anchor.id;
  constraint.T_cam_anchor = error * told.T_before.Inverse();
  constraint.information.setIdentity();
  constraint.information *= 1e9;  // one sigma is a hundredth of a pixel
  told.T_claimed = constraint.T_cam_anchor.Inverse();
  tracker->Constrain(std::vector<KeyframeConstraint>{constraint});
  const KeyframePosesPtr before = tracker->Poses();
  tracker->WaitForMapping();
  const KeyframePosesPtr after = tracker->Poses();
  for (const Keyframe& keyframe : keyframes) {
    told.num_moved +=
        AreEqual(before->At(keyframe.id).T_world_cam(), after->At(keyframe.id).T_world_cam()) ? 0U
                                                                                              : 1U;
  }
  EXPECT_EQ(after->version() > before->version(), told.num_moved > 0);
  tracker->WaitForMapping();
  EXPECT_EQ(tracker->Poses(), after);  // once is enough
  told.T_after = pose_of(anchor).Inverse() * pose_of(last);
  return told;
}

double Apart(const Pose& a, const Pose& b) {
  const Pose difference = a.Inverse() * b;
  return difference.RotationAngle() + difference.translation().norm();  // about 1 su away
}

class ConstrainedTracker : public testing::TestWithParam<std::string> {
 protected:
  static TrackerOptions Options() {
    TrackerOptions options;
    options.mode = GetParam();
    return options;
  }
};

// A pixel is 0.003 rad; the points know their keyframes to a small part of it.
const Pose kDrift(RotationExp({0.0006, -0.0003, 0.0009}), {0.0012, 0.0006, 0});
const Pose kElsewhere(RotationExp({0.1, 0, 0.1}), {0.3, 0, 0.1});

TEST_P(ConstrainedTracker, FollowsWhatItIsTold) {
  const Told told = FlyAndTell(kDrift, Options());
  EXPECT_GT(told.num_moved, 0U);
  // In live mode the keyframes, and so the points that know better, are others each time.
  const double share = GetParam() == "sequential" ? 0.9 : 1;
  EXPECT_LT(Apart(told.T_after, told.T_claimed), share * Apart(told.T_before, told.T_claimed));
}

TEST_P(ConstrainedTracker, StaysWhereItIsWhenThatCannotBe) {
  const Told told = FlyAndTell(kElsewhere, Options());
  EXPECT_EQ(told.num_moved, 0U);
  EXPECT_TRUE(AreEqual(told.T_after, told.T_before));
}

TEST_P(ConstrainedTracker, DoesNotListenWhenToldNotTo) {
  TrackerOptions options = Options();
  options.with_constraints = false;
  const Told told = FlyAndTell(kDrift, options);
  EXPECT_EQ(told.num_moved, 0U);
  EXPECT_TRUE(AreEqual(told.T_after, told.T_before));
}

INSTANTIATE_TEST_SUITE_P(Modes, ConstrainedTracker, testing::Values("sequential", "live"),
                         [](const auto& mode) { return mode.param; });

}  // namespace
}  // namespace mono3d::tracking
