// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/mesh_measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A square of two triangles in the plane z = 1, of edge 2.
TriangleMesh Square() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TriangleMesh Tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

TEST(MeshTopology, CountsTheEdgesOfASquare) {
  const MeshTopology topology = ComputeTopology(Square());
  EXPECT_EQ(topology.num_pieces, 1U);
  EXPECT_EQ(topology.num_triangles_of_largest, 2U);
  EXPECT_EQ(topology.num_edges, 5U);
  EXPECT_EQ(topology.num_open_edges, 4U);
  EXPECT_EQ(topology.num_crowded_edges, 0U);
  EXPECT_EQ(topology.num_flat_triangles, 0U);
  EXPECT_EQ(topology.num_unused_vertices, 0U);
}

TEST(MeshTopology, AClosedSurfaceHasNoOpenEdge) {
  const MeshTopology topology = ComputeTopology(Tetrahedron());
  EXPECT_EQ(topology.num_edges, 6U);
  EXPECT_EQ(topology.num_open_edges, 0U);
}

TEST(MeshTopology, CountsWhatIsWrong) {
  TriangleMesh mesh = Square();
  mesh.vertices.insert(mesh.vertices.end(), {{9, 9, 9}, {0, 0, 5}, {1, 0, 5}, {2, 0, 5}});
  mesh.triangles.push_back({0, 2, 1});  // a third one at its edges
  mesh.triangles.push_back({5, 6, 7});  // on a line, apart
  const MeshTopology topology = ComputeTopology(mesh);
  EXPECT_EQ(topology.num_pieces, 2U);
  EXPECT_EQ(topology.num_triangles_of_largest, 3U);
  EXPECT_EQ(topology.num_crowded_edges, 1U);
  EXPECT_EQ(topology.num_open_edges, 2U + 3U);
  EXPECT_EQ(topology.num_flat_triangles, 1U);
  EXPECT_EQ(topology.num_unused_vertices, 1U);
}

TEST(MeshArea, IsThatOfTheSquare) { EXPECT_DOUBLE_EQ(ComputeArea(Square()), 4); }

TEST(MeshSamples, SpreadEvenlyByArea) {
  TriangleMesh mesh = Square();
  mesh.vertices.push_back({2, 8, 1});  // another triangle of area 6 beyond the edge at y = 2
  mesh.triangles.push_back({3, 2, 4});
  constexpr std::size_t kCount = 10'000;
  const PointCloud samples = SampleMesh(mesh, kCount, 1);
  ASSERT_EQ(samples.size(), kCount);
  double in_square = 0;
  double in_corner = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Eigen::Vector3f& point = samples.points[i];
    EXPECT_FLOAT_EQ(point.z(), 1);
    EXPECT_EQ(samples.normals[i], Eigen::Vector3f(0, 0, 1));
    in_square += point.y() < 2 ? 1 : 0;
    in_corner += point.x() < 0.5 && point.y() < 0.5 ? 1 : 0;
  }
  // Four standard deviations of a share of so many.
  constexpr double kTolerance = 4 * 0.5 / 100;
  EXPECT_NEAR(in_square / kCount, 0.4, kTolerance);
  EXPECT_NEAR(in_corner / kCount, 0.025, kTolerance);
}

TEST(MeshSamples, TakeColoursBetweenThoseOfTheVertices) {
  TriangleMesh mesh = Square();
  mesh.colours = {{0, 7, 0}, {200, 7, 0}, {200, 7, 0}, {0, 7, 0}};  // red = 100 x
  const PointCloud samples = SampleMesh(mesh, 100, 1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_NEAR(samples.colours[i][0], 100 * samples.points[i].x(), 0.51);
    EXPECT_EQ(samples.colours[i][1], 7);
  }
}

TEST(MeshSamples, AreTheSameForTheSameSeed) {
  EXPECT_EQ(SampleMesh(Square(), 9, 5).points, SampleMesh(Square(), 9, 5).points);
  EXPECT_NE(SampleMesh(Square(), 9, 5).points, SampleMesh(Square(), 9, 6).points);
}

TEST(MeshSamples, AreRefusedOfAMeshWithoutArea) {
  EXPECT_THROW(SampleMesh({}, 1, 1), Error);
  TriangleMesh mesh = Square();
  mesh.vertices[2].x() = std::nanf("");
  EXPECT_THROW(SampleMesh(mesh, 1, 1), Error);
  mesh = Square();
  mesh.vertices.pop_back();
  EXPECT_THROW(SampleMesh(mesh, 1, 1), Error);
  EXPECT_THROW(ComputeTopology(mesh), Error);
  EXPECT_THROW(ComputeArea(mesh), Error);
}

}  // namespace
}  // namespace mono3d
