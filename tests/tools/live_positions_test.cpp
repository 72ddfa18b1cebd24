// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/geometry/stamped_pose.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

constexpr double kRate_hz = 6;  // the flight of 76 images takes 13 s

class LivePositionsRun : public TemporaryFolderTest {
 protected:
  // As a logger on the drone would, in metres.
  void WritePositions(const std::string& name) const {
    const std::vector<StampedPose> truth =
        ReadTrajectory(std::string(MONO3D_EXAMPLE) + "/groundtruth.txt");
    std::string text = "# origin (WGS84) 49.01 8.41 115\n";
    double time_s = 0;
    for (const StampedPose& pose : truth) {
      const Eigen::Vector3d& p_m = pose.T_world_cam.translation();
      char line[128];
      std::snprintf(line, sizeof line, "%.4f %.3f %.3f %.3f\n", time_s, p_m.x(), p_m.y(), p_m.z());
      text += line;
      time_s += 1 / kRate_hz;
    }
    WriteText(folder_ / name, text);
  }
};

// The file is not there at the beginning. (That the run is metric before its end is no matter for a
// test that another process may slow down: PositionFeed.LivePlacesTheMapWithoutWaiting.)
TEST_F(LivePositionsRun, TakesAFileThatIsWrittenMeanwhile) {
  WritePositions("all.txt");
  const std::string example = MONO3D_EXAMPLE;
  const std::string run = std::string(MONO3D_RECONSTRUCT_TOOL) + " " + example + " --camera " +
                          example + "/camera.yaml --camera-fixed --live --fps " +
                          std::to_string(kRate_hz) +
                          " --resize 384x224 --positions gps.txt --depth-files none -o out";
  // Once the run goes on.
  const std::string write =
      "for i in $(seq 600); do [ -e out/run.json ] && break; sleep 0.1; done; "
      "cp all.txt growing.txt; mv growing.txt gps.txt";
  const CommandResult result = RunCommand(
      "cd " + folder_.string() + "; (" + write + ") & " + run + "; rc=$?; wait; exit $rc", folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("positions: none yet in gps.txt"));
  EXPECT_THAT(result.output, HasSubstr("on the earth: scale +- "));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["options"]["tracking.mode"], "live");
  const nlohmann::json& map = record["maps"][0];
  EXPECT_EQ(map["axes"]["of"], "earth");
  EXPECT_GT(map["georeference"]["fixes_used"], 10);
  EXPECT_LT(map["georeference"]["scale_sigma"], 0.05);
  const std::vector<StampedPose> found = ReadTrajectory(folder_ / "out/trajectory.txt");
  const std::vector<StampedPose> truth = ReadTrajectory(example + "/groundtruth.txt");
  ASSERT_GT(found.size(), 2U);
  const auto true_place = [&](const StampedPose& pose) {
    const auto frame = static_cast<std::size_t>(std::lround(kRate_hz * pose.timestamp_s));
    return truth.at(frame).T_world_cam.translation();
  };
  const double length_m =
      (found.back().T_world_cam.translation() - found.front().T_world_cam.translation()).norm();
  EXPECT_NEAR(length_m / (true_place(found.back()) - true_place(found.front())).norm(), 1, 0.02);
}

}  // namespace
}  // namespace mono3d
