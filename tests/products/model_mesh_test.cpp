// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/model_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"

namespace mono3d {
namespace {

constexpr float kHillsX = 12, kHillsY = 8;

float HeightOfHills(float x, float y) { return std::sin(x) * std::cos(y); }

PointCloud Hills(std::size_t num_surfels) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform;
  PointCloud cloud;
  for (std::size_t i = 0; i < num_surfels; ++i) {
    const float x = kHillsX * uniform(random), y = kHillsY * uniform(random);
    cloud.points.emplace_back(x, y, HeightOfHills(x, y));
    cloud.normals.push_back(
        Eigen::Vector3f(-std::cos(x) * std::cos(y), std::sin(x) * std::sin(y), 1).normalized());
    cloud.radii.push_back(0.06F);
    cloud.confidences.push_back(1);
    cloud.colours.push_back({10, 200, 30});
  }
  return cloud;
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

std::map<Edge, int> EdgesOf(const TriangleMesh& mesh) {
  std::map<Edge, int> edges;
  for (const auto& [a, b, c] : mesh.triangles) ++edges[{a, b}], ++edges[{b, c}], ++edges[{c, a}];
  return edges;
}

class ModelMeshTest : public TemporaryFolderTest {
 protected:
  std::filesystem::path Model() const { return folder_ / "model.ply"; }
};

// Where parts meet there would be open edges in the middle, or edges of more than two triangles.
TEST_F(ModelMeshTest, OfAModelInPartsHasNoSeams) {
  WritePly(Model(), Hills(30'000));
  constexpr std::size_t kTriangles = 3000;
  for (const std::size_t of_part : {std::size_t{2000}, std::size_t{1'000'000}}) {
    const ModelMesh made =
        MakeModelMesh(Model(), {.max_triangles = kTriangles, .max_surfels_of_part = of_part});
    EXPECT_EQ(made.num_parts > 10, of_part == 2000);
    EXPECT_NEAR(made.median_radius_su, 0.06, 1e-6);
    EXPECT_GT(made.num_triangles, 20'000U);
    EXPECT_LE(made.mesh.triangles.size(), kTriangles);
    EXPECT_GT(made.mesh.triangles.size(), 0.9 * kTriangles);
    EXPECT_EQ(made.mesh.colours.size(), made.mesh.vertices.size());
    const auto edges = EdgesOf(made.mesh);
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1) << "two triangles on one side";
      if (edges.contains({edge.second, edge.first})) continue;
      // An open one: on the border of the hills, which is one of surfels strewn at random.
      const Eigen::Vector3f middle =
          (made.mesh.vertices[edge.first] + made.mesh.vertices[edge.second]) / 2;
      const float from_border =
          std::min({middle.x(), kHillsX - middle.x(), middle.y(), kHillsY - middle.y()});
      EXPECT_LT(from_border, 0.4F) << middle.transpose();
    }
    // Surfels 0.06 wide in cells of 0.12: rounded by a few thousandths; decimation says its own.
    for (const Eigen::Vector3f& p : made.mesh.vertices) {
      const float u = std::clamp(p.x(), 0.F, kHillsX), v = std::clamp(p.y(), 0.F, kHillsY);
      ASSERT_LT(std::abs(p.z() - HeightOfHills(u, v)), 0.15F);
    }
  }
}

TEST_F(ModelMeshTest, OfASmallModelIsTheSameHoweverManyPartsThereMayBe) {
  WritePly(Model(), Hills(5000));
  const ModelMesh one = MakeModelMesh(Model(), {.max_triangles = 1'000'000});
  const ModelMesh parts =
      MakeModelMesh(Model(), {.max_triangles = 1'000'000, .max_surfels_of_part = 500});
  EXPECT_GT(parts.num_parts, 5U);
  EXPECT_EQ(one.mesh.triangles.size(), parts.mesh.triangles.size());
  EXPECT_EQ(one.mesh.vertices.size(), parts.mesh.vertices.size());
  EXPECT_EQ(one.num_triangles, parts.num_triangles);
  EXPECT_EQ(parts.error_su, 0);
}

TEST_F(ModelMeshTest, RefusesAModelOfBarePoints) {
  PointCloud points;
  points.points = {{1, 2, 3}};
  WritePly(Model(), points);
  EXPECT_THROW(MakeModelMesh(Model()), Error);
}

}  // namespace
}  // namespace mono3d
