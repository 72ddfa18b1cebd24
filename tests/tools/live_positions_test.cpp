// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

// The file is not there at the beginning; what the run has so far is in metres soon after.
TEST_F(LivePositionsRun, IsMetricWhileItGoesOn) {
  WritePositions("all.txt");
  const std::string example = MONO3D_EXAMPLE;
  const std::string run = std::string(MONO3D_RECONSTRUCT_TOOL) + " " + example + " --camera " +
                          example + "/camera.yaml --camera-fixed --live --fps " +
                          std::to_string(kRate_hz) +
                          " --resize 384x224 --positions gps.txt --depth-files none -o out";
  // Keeps the latest record of before the end that has a place.
  const std::string watch =
      "while [ ! -e ended ]; do sleep 0.2; [ -e out/run.json ] && cp out/run.json seen.json; "
      "grep -q '\"end\": \"unfinished\"' seen.json && grep -q '\"georeference\"' seen.json && "
      "cp seen.json metric.json; done 2>/dev/null";
  const CommandResult result =
      RunCommand("cd " + folder_.string() + "; (sleep 1; cp all.txt growing.txt; mv growing.txt " +
                     "gps.txt) & (" + watch + ") & " + run + "; rc=$?; touch ended; wait; exit $rc",
                 folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("positions: none yet in gps.txt"));
  EXPECT_THAT(result.output, HasSubstr("on the earth: scale +- "));
  ASSERT_TRUE(std::filesystem::exists(folder_ / "metric.json")) << "it was not on the earth before";
  for (const char* name : {"metric.json", "out/run.json"}) {
    const auto record = nlohmann::json::parse(std::ifstream(folder_ / name));
    const nlohmann::json& map = record["maps"][0];
    EXPECT_EQ(map["axes"]["of"], "earth") << name;
    EXPECT_GT(map["georeference"]["fixes_used"], 10) << name;
    EXPECT_LT(map["georeference"]["scale_sigma"], 0.05) << name;
  }
  const std::vector<StampedPose> found = ReadTrajectory(folder_ / "out/trajectory.txt");
  const std::vector<StampedPose> truth = ReadTrajectory(example + "/groundtruth.txt");
  ASSERT_EQ(found.size(), truth.size());
  const auto length_m = [](const std::vector<StampedPose>& path) {
    return (path.back().T_world_cam.translation() - path.front().T_world_cam.translation()).norm();
  };
  EXPECT_NEAR(length_m(found) / length_m(truth), 1, 0.01);
}

}  // namespace
}  // namespace mono3d
