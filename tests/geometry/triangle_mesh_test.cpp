// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kSpacing = 0.1;
constexpr float kRadius = 0.1F;

void AddSurfel(PointCloud& cloud, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  cloud.points.push_back(point.cast<float>());
  cloud.normals.push_back(normal.cast<float>());
  cloud.radii.push_back(kRadius);
  cloud.colours.push_back({200, 100, 50});
  cloud.confidences.push_back(0.5F);
}

// A rectangle with corners at `corner`, + a, + b; outwards is a x b.
void AddRectangle(PointCloud& cloud, const Eigen::Vector3d& corner, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b) {
  const Eigen::Vector3d normal = a.cross(b).normalized();
  const int num_a = static_cast<int>(std::lround(a.norm() / kSpacing));
  const int num_b = static_cast<int>(std::lround(b.norm() / kSpacing));
  for (int i = 0; i < num_a; ++i) {
    for (int j = 0; j < num_b; ++j) {
      AddSurfel(cloud, corner + (i + 0.5) / num_a * a + (j + 0.5) / num_b * b, normal);
    }
  }
}

constexpr double kWidth = 4;
constexpr double kDepth = 3;
constexpr double kHeight = 2;

// All six sides of a box at the origin.
PointCloud House() {
  const Eigen::Vector3d o(0, 0, 0);
  const Eigen::Vector3d x(kWidth, 0, 0);
  const Eigen::Vector3d y(0, kDepth, 0);
  const Eigen::Vector3d z(0, 0, kHeight);
  PointCloud house;
  AddRectangle(house, o, y, x);
  AddRectangle(house, z, x, y);
  AddRectangle(house, o, x, z);
  AddRectangle(house, y, z, x);
  AddRectangle(house, o, z, y);
  AddRectangle(house, x, y, z);
  return house;
}

double DistanceToHouse(const Eigen::Vector3f& vertex) {
  const Eigen::Array3d half(kWidth / 2, kDepth / 2, kHeight / 2);
  const Eigen::Array3d beyond = (vertex.cast<double>().array() - half).abs() - half;
  return beyond.max(0).matrix().norm() + std::min(0.0, beyond.maxCoeff());
}

// How many triangles run along each edge in each direction.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> CountEdges(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
  for (const auto& [a, b, c] : mesh.triangles) ++count[{a, b}], ++count[{b, c}], ++count[{c, a}];
  return count;
}

double VolumeOf(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    volume += mesh.vertices[a].cross(mesh.vertices[b]).dot(mesh.vertices[c]) / 6.0;
  }
  return volume;
}

TEST(MeshSurfels, IsWatertightWhereTheSurfelsClose) {
  const TriangleMesh mesh = MeshSurfels(House());
  ASSERT_FALSE(mesh.triangles.empty());
  const auto edges = CountEdges(mesh);
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first})) << "an open edge";
  }
  // Euler: one closed surface without a handle.
  EXPECT_EQ(mesh.vertices.size() + mesh.triangles.size() - edges.size() / 2, 2U);
}

TEST(MeshSurfels, FollowsTheSurfaceAndPointsOutwards) {
  const TriangleMesh mesh = MeshSurfels(House());
  // Edges are rounded over about a cell, of two radii.
  constexpr double kCell = 2 * kRadius;
  double sum = 0;
  for (const auto& vertex : mesh.vertices) {
    EXPECT_LT(std::abs(DistanceToHouse(vertex)), kCell);
    sum += std::abs(DistanceToHouse(vertex));
  }
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.size()), 0.1 * kCell);
  // Positive when triangles run counter-clockwise seen from outside.
  EXPECT_NEAR(VolumeOf(mesh), kWidth * kDepth * kHeight, 0.03 * kWidth * kDepth * kHeight);
  const Eigen::Vector3f middle(kWidth / 2, kDepth / 2, kHeight / 2);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_NEAR(mesh.normals[i].norm(), 1, 1e-4);
    EXPECT_GT(mesh.normals[i].dot(mesh.vertices[i] - middle), 0);
    EXPECT_EQ(mesh.colours[i], (std::array<std::uint8_t, 3>{200, 100, 50}));
  }
}

TEST(MeshSurfels, EndsWhereTheSurfelsEnd) {
  PointCloud plane;
  AddRectangle(plane, {0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  const TriangleMesh mesh = MeshSurfels(plane);
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f p = mesh.vertices[a];
    area += (mesh.vertices[b] - p).cross(mesh.vertices[c] - p).norm() / 2;
  }
  // A vertex keeps a thousandth of a cell of 0.2 from the corners, which lie on the plane here.
  for (const auto& vertex : mesh.vertices) EXPECT_NEAR(vertex.z(), 0, 2.1e-4);
  // A border of up to two cells of 0.2 around.
  EXPECT_GT(area, 4 * 3);
  EXPECT_LT(area, 4.8 * 3.8);
}

TEST(MeshSurfels, AveragesNoiseAway) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.03F);
  PointCloud house = House();
  for (std::size_t i = 0; i < house.size(); ++i) {
    house.points[i] += noise(random) * house.normals[i];
  }
  const TriangleMesh mesh = MeshSurfels(house);
  double squares = 0;
  int count = 0;
  for (const auto& vertex : mesh.vertices) {
    if (vertex.z() < kHeight - 0.1F ||
        (vertex - Eigen::Vector3f(2, 1.5F, 2)).head<2>().norm() > 1) {
      continue;  // the middle of the roof
    }
    squares += std::pow(vertex.z() - kHeight, 2);
    ++count;
  }
  ASSERT_GT(count, 50);
  EXPECT_LT(std::sqrt(squares / count), 0.015);  // half of it: a mean over some ten surfels
}

TEST(MeshSurfels, DoesNotDependOnScaleAndPlace) {
  PointCloud moved = House();
  for (std::size_t i = 0; i < moved.size(); ++i) {
    moved.points[i] = moved.points[i] * 1024 + Eigen::Vector3f::Constant(4096);
    moved.radii[i] *= 1024;
  }
  const TriangleMesh mesh = MeshSurfels(House());
  const TriangleMesh other = MeshSurfels(moved);
  // A power of two scales floats exactly; the shift rounds them.
  EXPECT_NEAR(static_cast<double>(other.triangles.size()),
              static_cast<double>(mesh.triangles.size()),
              0.01 * static_cast<double>(mesh.triangles.size()));
  EXPECT_NEAR(VolumeOf(other) / std::pow(1024.0, 3), VolumeOf(mesh), 0.1);
}

TEST(MeshSurfels, LeavesOutSmallPieces) {
  PointCloud cloud = House();
  const std::size_t num_triangles = MeshSurfels(cloud).triangles.size();
  AddRectangle(cloud, {20, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0});
  EXPECT_EQ(MeshSurfels(cloud).triangles.size(), num_triangles);
  EXPECT_GT(MeshSurfels(cloud, {.min_triangles = 1}).triangles.size(), num_triangles);
}

TEST(MeshSurfels, RefusesWhatItCannotMesh) {
  EXPECT_THROW(MeshSurfels({}), Error);
  PointCloud broken = House();
  broken.points[5].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(MeshSurfels(broken), Error);
  PointCloud without_normals = House();
  without_normals.normals.clear();
  EXPECT_THROW(MeshSurfels(without_normals), Error);
  EXPECT_THROW(MeshSurfels(House(), {.voxel_radii = 0}), UsageError);
  EXPECT_THROW(MeshSurfels(House(), {.min_triangles = 0}), UsageError);
}

}  // namespace
}  // namespace mono3d
