// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/trajectory_file.h"

#include <gmock/gmock.h>

#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

using TrajectoryFile = TemporaryFolderTest;

TEST_F(TrajectoryFile, ReadsALineByHand) {
  const auto poses =
      ReadTrajectory(WriteText("t.txt", "# a comment\n\n1.5 1 2 3 0 0 0.7071 0.7071\r\n"));
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].timestamp_s, 1.5);
  // A quarter turn about z takes x to y.
  const Eigen::Vector3d p_world = poses[0].T_world_cam * Eigen::Vector3d(1, 0, 0);
  EXPECT_TRUE(p_world.isApprox(Eigen::Vector3d(1, 3, 3), 1e-12)) << p_world.transpose();
}

TEST_F(TrajectoryFile, SurvivesWritingAndReading) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Quaterniond rotation(
        Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d(1, 2, 3).normalized()));
    poses.push_back({i / 30.0, Pose(rotation, Eigen::Vector3d(1e6 / 3, -1.0 / 7, 1e-9 * i))});
  }
  WriteTrajectory(folder_ / "t.txt", poses);
  const auto read = ReadTrajectory(folder_ / "t.txt");
  ASSERT_EQ(read.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(read[i].timestamp_s, poses[i].timestamp_s);
    EXPECT_EQ(read[i].T_world_cam.translation(), poses[i].T_world_cam.translation());
    // Reading normalises once more: one rounding of the last digit.
    EXPECT_LT(read[i].T_world_cam.rotation().angularDistance(poses[i].T_world_cam.rotation()),
              1e-15);
  }
}

TEST_F(TrajectoryFile, MayBeEmpty) {
  WriteTrajectory(folder_ / "t.txt", {});
  EXPECT_THAT(ReadTrajectory(folder_ / "t.txt"), IsEmpty());
}

TEST_F(TrajectoryFile, RefusesAQuaternionThatIsNotOfUnitLength) {
  EXPECT_THAT(
      [&] { ReadTrajectory(WriteText("t.txt", "# t\n0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 2\n")); },
      ThrowsMessage<Error>(
          HasSubstr("t.txt:3: quaternion of a pose is not of unit length (expected length 1, found "
                    "length 2)")));
  EXPECT_THAT([&] { ReadTrajectory(WriteText("t.txt", "0 0 0 0 0 0 0 0\n")); },
              ThrowsMessage<Error>(HasSubstr("found length 0")));
}

TEST_F(TrajectoryFile, RefusesWrongCountsAndValues) {
  EXPECT_THAT([&] { ReadTrajectory(WriteText("t.txt", "0 0 0 0 0 0 1\n")); },
              ThrowsMessage<Error>(HasSubstr("t.txt:1: wrong number of values in a pose (expected "
                                             "8: timestamp tx ty tz qx qy qz qw, found 7)")));
  for (const char* value : {"nan", "inf", "x", "1,5", "1e999"}) {
    EXPECT_THAT(
        [&] { ReadTrajectory(WriteText("t.txt", std::string("0 0 ") + value + " 0 0 0 0 1")); },
        ThrowsMessage<Error>(HasSubstr(std::string("expected a finite number, found ") + value)));
  }
}

}  // namespace
}  // namespace mono3d
