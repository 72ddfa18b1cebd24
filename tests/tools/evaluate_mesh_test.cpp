// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-evaluate run, of a run with a mesh.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "mono3d/io/mesh_file.h"
#include "mono3d/io/ply_file.h"
#include "tools/command.h"
#include "tools/small_run.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class EvaluateMesh : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_evaluate_mesh_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    paths_ = WriteSmallRun(folder_);
    // The model has a column of so many points after the other, 0.2 m apart.
    PointCloud model = ReadPly(paths_.run / "model.ply");
    const auto column = static_cast<std::uint32_t>(std::lround(std::sqrt(model.size())));
    ASSERT_EQ(model.size(), std::size_t{column} * column);
    model.radii.assign(model.size(), 0.2F * static_cast<float>(kSmallRunScale));
    WritePly(paths_.run / "model.ply", model);
    mesh_.vertices = model.points;
    mesh_.normals.assign(model.size(), {0, 0, -1});
    for (std::uint32_t i = 0; i + column < model.size(); ++i) {
      if (i % column == column - 1) continue;
      mesh_.triangles.push_back({i, i + 1, i + column});
      mesh_.triangles.push_back({i + 1, i + column + 1, i + column});
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  CommandResult Run() const {
    return RunCommand(
        "cd " + folder_.string() + " && " + MONO3D_EVALUATE_TOOL + " run run sequence --no-report",
        folder_);
  }
  nlohmann::json Result() const {
    return nlohmann::json::parse(std::ifstream(folder_ / "run/evaluation.json"));
  }

  std::filesystem::path folder_;
  SmallRun paths_;
  TriangleMesh mesh_;
};

TEST_F(EvaluateMesh, StandsBesideTheSurfels) {
  WriteMeshPly(paths_.run / "mesh.ply", mesh_);
  const CommandResult result = Run();
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("Mesh: distances"), HasSubstr("surfels, by area"),
                                   HasSubstr("Mesh: how it hangs together")));
  EXPECT_TRUE(Result()["left_out"].empty()) << Result()["left_out"];
  const nlohmann::json mesh = Result()["model"]["model"]["mesh"];
  EXPECT_EQ(mesh["triangles"], mesh_.triangles.size());
  EXPECT_EQ(mesh["samples"], mesh_.vertices.size());
  EXPECT_EQ(mesh["pieces"], 1);
  EXPECT_EQ(mesh["open_edges"], 4 * (std::lround(std::sqrt(mesh_.vertices.size())) - 1));
  EXPECT_EQ(mesh["crowded_edges"], 0);
  EXPECT_EQ(mesh["unsupported_share"], 0);
  EXPECT_EQ(mesh["missed_surfel_share"], 0);
  // Between points 0.2 m apart, on a surface with radii of about one metre.
  EXPECT_LT(mesh["error"]["estimate_to_truth_m"]["max"], 0.3);
  EXPECT_LT(mesh["error"]["estimate_to_truth_plane_m"]["rmse"], 0.02);
  EXPECT_EQ(mesh["whole_surface"]["shares"][2]["accuracy"], 1) << "0.2 m of it";
}

TEST_F(EvaluateMesh, InventedSurfaceIsCountedAndStandsInTheError) {
  // One triangle of 50 m^2 off the edge of an area that measures more than 64.
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(14, 0, 10), Eigen::Vector3d(24, 0, 10), Eigen::Vector3d(14, 10, 10)}) {
    mesh_.vertices.emplace_back((kSmallRunScale * corner).cast<float>());
    mesh_.normals.emplace_back(0, 0, -1);
  }
  mesh_.triangles.push_back({first, first + 1, first + 2});
  WriteMeshPly(paths_.run / "mesh.ply", mesh_);
  ASSERT_EQ(Run().exit_status, 0);
  const nlohmann::json mesh = Result()["model"]["model"]["mesh"];
  EXPECT_EQ(mesh["pieces"], 2);
  const double share = 50 / mesh["area_m2"].get<double>();
  EXPECT_LT(share, 50.0 / (50 + 64));
  EXPECT_NEAR(mesh["unsupported_share"], share, 0.05);  // four standard deviations
  EXPECT_GT(mesh["largest_gap_radii"], 10 / 0.2);
  EXPECT_GT(mesh["error"]["estimate_to_truth_m"]["rmse"], 10 * std::sqrt(share));
}

TEST_F(EvaluateMesh, ABrokenMeshIsLeftOutWithTheReason) {
  WriteMeshPly(paths_.run / "mesh.ply", mesh_);
  const std::string bytes = ReadText(paths_.run / "mesh.ply");
  WriteText(paths_.run / "mesh.ply", bytes.substr(0, bytes.size() - 1));
  const CommandResult result = Run();
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("left out: mesh: run/mesh.ply: bad faces of a mesh"));
  EXPECT_FALSE(Result()["model"]["model"].contains("mesh"));
  EXPECT_TRUE(Result()["model"]["model"].contains("error")) << "the surfels are judged";
}

}  // namespace
}  // namespace mono3d
