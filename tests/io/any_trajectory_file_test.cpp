// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/any_trajectory_file.h"

#include <gmock/gmock.h>

#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/timestamps_file.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

using AnyTrajectoryFile = TemporaryFolderTest;

// A quarter turn about z, from (1, 2, 3): camera x is world y.
constexpr const char* kKitti = "0 -1 0 1 1 0 0 2 0 0 1 3\n";
// The same camera from world to camera: R^T = a quarter turn back, -R^T t = (-2, 1, -3).
constexpr const char* kColmap =
    "# Image list with two lines of data per image:\n"
    "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
    "7 0.70710678118654752 0 0 -0.70710678118654752 -2 1 -3 1 cam0/frame_000012.jpg\n"
    "10.5 20.25 -1 30 40 17\n"
    "8 1 0 0 0 0 0 0 1 last one 13.jpg\n"
    "\n";
constexpr double kPoseRounding = 1e-12;

void ExpectQuarterTurn(const Pose& T_world_cam) {
  EXPECT_TRUE(
      (T_world_cam * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 3, 3), kPoseRounding))
      << T_world_cam.Matrix();
  EXPECT_TRUE(T_world_cam.translation().isApprox(Eigen::Vector3d(1, 2, 3), kPoseRounding))
      << T_world_cam.Matrix();
}

TEST_F(AnyTrajectoryFile, IsToldByItsContent) {
  EXPECT_EQ(DetectTrajectoryForm(WriteText("a", "# t\n\n0 0 0 0 0 0 0 1\n")), TrajectoryForm::kTum);
  EXPECT_EQ(DetectTrajectoryForm(WriteText("b", kKitti)), TrajectoryForm::kKitti);
  EXPECT_EQ(DetectTrajectoryForm(WriteText("c", kColmap)), TrajectoryForm::kColmap);
  // Twelve words, but an image: a name of three words.
  EXPECT_EQ(DetectTrajectoryForm(WriteText("d", "1 1 0 0 0 0 0 0 1 my image 5.png\n")),
            TrajectoryForm::kColmap);
  EXPECT_EQ(DetectTrajectoryForm(WriteText("e", "# nothing\n")), TrajectoryForm::kTum);
  EXPECT_THAT([&] { DetectTrajectoryForm(WriteText("f", "# t\n1 2 3\n")); },
              ThrowsMessage<Error>(HasSubstr("f:2: not a trajectory of a known form")));
}

TEST_F(AnyTrajectoryFile, OfTumIsReadAsReadTrajectoryDoes) {
  const auto poses = ReadAnyTrajectory(WriteText("t", "1.5 1 2 3 0 0 0.7071068 0.7071068\n"));
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].timestamp_s, 1.5);
  ExpectQuarterTurn(poses[0].T_world_cam);
}

TEST_F(AnyTrajectoryFile, OfKittiIsCameraToWorldRowByRow) {
  const auto path = WriteText("t", std::string(kKitti) + "1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto poses = ReadAnyTrajectory(path);
  ASSERT_EQ(poses.size(), 2U);
  ExpectQuarterTurn(poses[0].T_world_cam);
  EXPECT_EQ(poses[1].timestamp_s, 1.0 / 30);
  TrajectoryTimes times;
  times.fps = 4;
  EXPECT_EQ(ReadAnyTrajectory(path, times)[1].timestamp_s, 0.25);
  times.timestamps_s = {5, 7.5};
  EXPECT_EQ(ReadAnyTrajectory(path, times)[1].timestamp_s, 7.5);
  times.timestamps_s = {5};
  EXPECT_THAT(
      [&] { ReadAnyTrajectory(path, times); },
      ThrowsMessage<Error>(HasSubstr("t:2: no time for a pose (expected a number below 1")));
}

TEST_F(AnyTrajectoryFile, OfKittiRefusesWhatIsNoRotation) {
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", "2 0 0 0 0 1 0 0 0 0 1 0\n")); },
              ThrowsMessage<Error>(HasSubstr("t:1: the left 3x3 of a pose is not a rotation")));
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", "-1 0 0 0 0 1 0 0 0 0 1 0\n")); },
              ThrowsMessage<Error>(HasSubstr("found determinant -1")));
  EXPECT_THAT(
      [&] { ReadAnyTrajectory(WriteText("t", std::string(kKitti) + "1 2 3\n")); },
      ThrowsMessage<Error>(HasSubstr("t:2: wrong number of values in a pose (expected 12")));
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", "nan 0 0 0 0 1 0 0 0 0 1 0\n")); },
              ThrowsMessage<Error>(HasSubstr("expected a finite number, found nan")));
}

TEST_F(AnyTrajectoryFile, OfColmapIsTurnedAroundAndTimedByTheNumberInTheName) {
  const auto poses = ReadAnyTrajectory(WriteText("images.txt", kColmap));
  ASSERT_EQ(poses.size(), 2U);
  ExpectQuarterTurn(poses[0].T_world_cam);
  EXPECT_EQ(poses[0].timestamp_s, 12.0 / 30);
  EXPECT_EQ(poses[1].timestamp_s, 13.0 / 30);
}

TEST_F(AnyTrajectoryFile, OfColmapTakesTimesByNameFirst) {
  TrajectoryTimes times;
  times.time_of_image_s = {{"last one 13.jpg", 99.5}};
  times.timestamps_s.assign(13, 1.25);
  const auto poses = ReadAnyTrajectory(WriteText("images.txt", kColmap), times);
  EXPECT_EQ(poses[0].timestamp_s, 1.25);
  EXPECT_EQ(poses[1].timestamp_s, 99.5);
}

TEST_F(AnyTrajectoryFile, OfColmapMayLackTheLinesOfPoints) {
  const auto poses =
      ReadAnyTrajectory(WriteText("t", "1 1 0 0 0 0 0 0 1 a1.png\n2 1 0 0 0 0 0 0 1 a2.png"));
  EXPECT_EQ(poses.size(), 2U);
}

TEST_F(AnyTrajectoryFile, OfColmapRefusesBadLines) {
  const std::string good = "1 1 0 0 0 0 0 0 1 a1.png\n\n";
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", good + "2 1 0 0 0 0 0 0 1\n")); },
              ThrowsMessage<Error>(HasSubstr("t:3: bad line of an image")));
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", "1 1 0 0 0 0 0 0 1 a1.png\n1 2 3 4\n")); },
              ThrowsMessage<Error>(HasSubstr("t:2: bad line of points behind an image")));
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", good + "2 1 1 0 0 0 0 0 1 a2.png\n")); },
              ThrowsMessage<Error>(HasSubstr("t:3: quaternion of a pose is not of unit length")));
  EXPECT_THAT([&] { ReadAnyTrajectory(WriteText("t", good + "2 1 0 0 0 0 0 0 1 front.png\n")); },
              ThrowsMessage<Error>(HasSubstr(
                  "t:3: no time for an image (expected a number in its name, found front.png)")));
}

TEST_F(AnyTrajectoryFile, RefusesABadFrameRate) {
  TrajectoryTimes times;
  times.fps = 0;
  EXPECT_THROW(ReadAnyTrajectory(WriteText("t", kKitti), times), UsageError);
}

using TimestampsFile = TemporaryFolderTest;

TEST_F(TimestampsFile, HoldsOneRisingTimeALine) {
  EXPECT_THAT(ReadTimestamps(WriteText("t", "# s\n0.000000e+00\n\n1.037e-01\n")),
              ElementsAre(0, 0.1037));
  EXPECT_THAT(ReadTimestamps(WriteText("t", "")), IsEmpty());
  for (const char* bad : {"1\n1\n", "0\n1 2\n", "0\nx\n"}) {
    EXPECT_THAT([&] { ReadTimestamps(WriteText("t", bad)); },
                ThrowsMessage<Error>(HasSubstr("t:2: bad timestamp")));
  }
}

}  // namespace
}  // namespace mono3d
