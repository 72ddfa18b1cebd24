// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A run with ground control points, as a user makes it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::HasSubstr;

// The places and marks are exact; the images are half as large as those that are marked, and the
// flight is 80 m away from what it looks at: a pixel is 23 cm wide there.
constexpr double kPixel_m = 0.23;

class RunWithGroundControl : public TemporaryFolderTest {
 protected:
  struct Marked {
    std::string name;
    Vector3d p_m;            // that the images show
    Vector3d surveyed_m;     // that the file has
    double mark_off_px = 0;  // of the mark in the first image
    std::string columns = {};
  };

  static std::vector<Marked> SixPoints() {
    std::vector<Marked> points;
    for (const Vector3d& p : {Vector3d(-14, -10, 0), Vector3d(14, -9, 1), Vector3d(13, 11, 0),
                              Vector3d(-13, 12, 2), Vector3d(2, 1, 0.5), Vector3d(-3, 9, 4)}) {
      points.push_back({"gcp" + std::to_string(points.size() + 1), p, p});
    }
    return points;
  }

  void WriteControl(const std::vector<Marked>& points) const {
    const CameraModel camera = ReadCameraFile(flight_ / "camera.yaml");
    const std::vector<StampedPose> truth = ReadTrajectory(flight_ / "groundtruth.txt");
    std::string text = "ENU 49.01 8.41 115\n";
    for (const Marked& point : points) {
      for (int frame = 0; frame < 36; frame += 5) {
        Eigen::Vector2d pixel = camera.Project(
            truth[static_cast<std::size_t>(frame)].T_world_cam.Inverse() * point.p_m);
        if (frame == 5) pixel.y() += point.mark_off_px;
        char line[200];
        std::snprintf(line, sizeof line, "%.4f %.4f %.4f %.3f %.3f %06d.JPG %s%s\n",
                      point.surveyed_m.x(), point.surveyed_m.y(), point.surveyed_m.z(), pixel.x(),
                      pixel.y(), frame, point.name.c_str(), point.columns.c_str());
        text += line;
      }
    }
    WriteText(folder_ / "gcp.txt", text);
  }

  CommandResult Reconstruct(const std::string& arguments) const {
    return RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + flight_.string() + " --camera " +
                          (flight_ / "camera.yaml").string() +
                          " --camera-fixed --resize 384x224 --tracking.features.num_features 600"
                          " --max-frames 36 --gcp " +
                          (folder_ / "gcp.txt").string() + " -o " + (folder_ / "out").string() +
                          arguments,
                      folder_);
  }

  nlohmann::json Georeference() const {
    return nlohmann::json::parse(ReadText(folder_ / "out/run.json"))["maps"][0]["georeference"];
  }

  // Root of the mean square distance of the cameras from the truth, in metres on the earth.
  double RmsOfCameras() const {
    const std::vector<StampedPose> truth = ReadTrajectory(flight_ / "groundtruth.txt");
    const nlohmann::json origin = Georeference()["origin"];
    const Geodetic place = {origin["latitude_deg"], origin["longitude_deg"], origin["altitude_m"]};
    double sum = 0;
    const std::vector<StampedPose> found = ReadTrajectory(folder_ / "out/trajectory.txt");
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Vector3d p_m =
          ToEnu(ToGeodetic(found[i].T_world_cam.translation(), place), {49.01, 8.41, 115});
      sum += (p_m - truth[i].T_world_cam.translation()).squaredNorm();
    }
    EXPECT_EQ(found.size(), 36U);
    return std::sqrt(sum / static_cast<double>(found.size()));
  }

  std::filesystem::path flight_ = MONO3D_EXAMPLE;
};

TEST_F(RunWithGroundControl, IsInMetresWhereTheSurveyWas) {
  std::vector<Marked> points = SixPoints();
  points[3].mark_off_px = 60;
  points[4].columns = " check";
  Marked wrong{"moved", {6, -12, 0}, {11, -12, 3}};
  points.push_back(wrong);
  WriteControl(points);
  const CommandResult run = Reconstruct(" --check-points gcp6");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  EXPECT_THAT(run.output,
              AllOf(HasSubstr("ground control: 5 points and 2 check points, 56 marks"),
                    HasSubstr("ground control: 4 of 5 points used"), HasSubstr("check points: 2"),
                    HasSubstr("moved: it contradicts the other control points"),
                    HasSubstr("gcp4: its mark contradicts the others in 000005.JPG")));
  const nlohmann::json found = Georeference();
  EXPECT_TRUE(found["by_ground_control"]);
  ASSERT_EQ(found["ground_control"].size(), 7U);
  for (const nlohmann::json& point : found["ground_control"]) {
    const std::string name = point["name"];
    if (name == "moved") {
      EXPECT_FALSE(point["used"]);
      EXPECT_NEAR(point["residual_m"]["east"].get<double>(), -5, 2 * kPixel_m);
      continue;
    }
    EXPECT_EQ(point["used"].get<bool>(), name != "gcp5" && name != "gcp6") << name;
    for (const char* axis : {"east", "north", "up"}) {
      EXPECT_LT(std::abs(point["residual_m"][axis].get<double>()), kPixel_m) << name << axis;
    }
    EXPECT_LT(point["residual_px"].get<double>(), 2) << name;
  }
  EXPECT_LT(RmsOfCameras(), 2 * kPixel_m);
  EXPECT_THAT(ReadText(folder_ / "out/report.html"),
              AllOf(HasSubstr("Ground control points: map minus survey"), HasSubstr("moved"),
                    HasSubstr("check point")));
}

TEST_F(RunWithGroundControl, WithTwoPointsItSaysSoAndGoesOnWithoutThem) {
  std::vector<Marked> points = SixPoints();
  points.resize(2);
  for (Marked& point : points) point.columns = "";
  points[0].name = "only";
  points[1].columns = " check";
  WriteControl(points);
  const CommandResult run = Reconstruct("");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  EXPECT_THAT(run.output, HasSubstr("1 usable control point in this map, three needed"));
}

TEST_F(RunWithGroundControl, WhatIsWrongIsSaidBeforeAnythingIsWritten) {
  WriteControl(SixPoints());
  const CommandResult unknown = Reconstruct(" --check-points gcp9");
  EXPECT_EQ(unknown.exit_status, kWrongUsage);
  EXPECT_THAT(unknown.errors, AllOf(HasSubstr("gcp9"), HasSubstr("gcp.txt")));
  const CommandResult live = Reconstruct(" --live");
  EXPECT_EQ(live.exit_status, kWrongUsage);
  EXPECT_THAT(live.errors, HasSubstr("--live"));
  WriteText(folder_ / "gcp.txt", "1 2 3 4 5 a.jpg\n");
  const CommandResult without = Reconstruct("");
  EXPECT_EQ(without.exit_status, kFailure);
  EXPECT_THAT(without.errors, AllOf(HasSubstr("gcp.txt:1"), HasSubstr("coordinate system")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

}  // namespace
}  // namespace mono3d
