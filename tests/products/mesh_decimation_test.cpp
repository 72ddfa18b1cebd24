// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/mesh_decimation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "mono3d/core/error.h"
#include "mono3d/geometry/mesh_measures.h"

namespace mono3d {
namespace {

// 50 x 50 squares over 10 x 10, `height` high in the middle.
TriangleMesh Hill(float height) {
  constexpr std::uint32_t kSquares = 50;
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y <= kSquares; ++y) {
    for (std::uint32_t x = 0; x <= kSquares; ++x) {
      const float u = static_cast<float>(x) / 5 - 5;
      const float v = static_cast<float>(y) / 5 - 5;
      mesh.vertices.emplace_back(u, v, height * std::exp(-(u * u + v * v) / 4));
      mesh.colours.push_back({static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 0});
    }
  }
  for (std::uint32_t y = 0; y < kSquares; ++y) {
    for (std::uint32_t x = 0; x < kSquares; ++x) {
      const std::uint32_t a = y * (kSquares + 1) + x;
      mesh.triangles.push_back({a, a + 1, a + kSquares + 2});
      mesh.triangles.push_back({a, a + kSquares + 2, a + kSquares + 1});
    }
  }
  return mesh;
}

TEST(Decimate, KeepsAPlane) {
  const DecimatedMesh result = Decimate(Hill(0), 100);
  EXPECT_LE(result.mesh.triangles.size(), 100u);
  EXPECT_NEAR(ComputeArea(result.mesh), 100, 1e-2);
  EXPECT_LT(result.error_su, 1e-3);
  EXPECT_EQ(result.mesh.colours.size(), result.mesh.vertices.size());
  for (const Eigen::Vector3f& normal : result.mesh.normals) EXPECT_NEAR(normal.z(), 1, 1e-5);
  EXPECT_EQ(ComputeTopology(result.mesh).num_unused_vertices, 0u);
}

TEST(Decimate, KeepsTheShapeOfAHill) {
  const TriangleMesh hill = Hill(2);
  const DecimatedMesh result = Decimate(hill, 1000);
  EXPECT_LE(result.mesh.triangles.size(), 1000u);
  EXPECT_GT(result.mesh.triangles.size(), 900u);
  EXPECT_NEAR(ComputeArea(result.mesh), ComputeArea(hill), .01 * ComputeArea(hill));
  EXPECT_LT(result.error_su, .05);
  for (const Eigen::Vector3f& p : result.mesh.vertices) {
    EXPECT_NEAR(p.z(), 2 * std::exp(-(p.x() * p.x() + p.y() * p.y()) / 4), 1e-5);
  }
}

TEST(Decimate, LeavesWhatIsSmallEnough) {
  const TriangleMesh hill = Hill(2);
  const DecimatedMesh result = Decimate(hill, 5000);
  EXPECT_EQ(result.mesh.triangles.size(), hill.triangles.size());
  EXPECT_EQ(result.error_su, 0);
}

TEST(Decimate, RefusesADamagedMesh) {
  TriangleMesh mesh = Hill(0);
  mesh.triangles[7][0] = 99999;
  EXPECT_THROW(Decimate(mesh, 100), Error);
  mesh = Hill(0);
  mesh.vertices[3].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(Decimate(mesh, 100), Error);
}

}  // namespace
}  // namespace mono3d
