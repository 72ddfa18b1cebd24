// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/mesh_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono3d/core/error.h"
#include "mono3d/geometry/mesh_measures.h"

namespace mono3d {
namespace {

constexpr float kRadius = 0.1F;
constexpr std::size_t kNumSamples = 20'000;

// A rectangle in the plane z = 0, from x = 0 to `width`, from y = 0 to 1.
TriangleMesh Rectangle(float width) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {width, 0, 0}, {width, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

// A surfel every half radius over the same rectangle.
PointCloud Surfels(float width) {
  PointCloud surfels;
  for (float x = 0; x < width + 1e-3F; x += kRadius / 2) {
    for (float y = 0; y < 1 + 1e-3F; y += kRadius / 2) {
      surfels.points.emplace_back(x, y, 0.0F);
      surfels.radii.push_back(kRadius);
    }
  }
  return surfels;
}

MeshFit Fit(const TriangleMesh& mesh, const PointCloud& surfels) {
  return FitOfMesh(mesh, SampleMesh(mesh, kNumSamples, 1), surfels);
}

TEST(MeshFit, IsPerfectWhereBothEndTogether) {
  const MeshFit fit = Fit(Rectangle(2), Surfels(2));
  EXPECT_EQ(fit.unsupported_share, 0);
  EXPECT_LT(fit.largest_gap_radii, 0.5);  // half a diagonal between surfels
  EXPECT_EQ(fit.missed_share, 0);
}

TEST(MeshFit, TellsInventedSurface) {
  // Mesh on to x = 2; surfels to 1, which speak for two radii more: up to 1.2.
  const MeshFit fit = Fit(Rectangle(2), Surfels(1));
  EXPECT_NEAR(fit.unsupported_share, 0.4, 0.015);  // four standard deviations
  EXPECT_NEAR(fit.largest_gap_radii, 10, 0.2);
  EXPECT_EQ(fit.missed_share, 0);
}

TEST(MeshFit, TellsMissedSurfels) {
  const MeshFit fit = Fit(Rectangle(1), Surfels(2));
  EXPECT_EQ(fit.unsupported_share, 0);
  EXPECT_NEAR(fit.missed_share, 0.4, 0.03);  // one row of surfels of 41
}

TEST(MeshFit, RefusesWhatCannotBeCompared) {
  const TriangleMesh mesh = Rectangle(1);
  EXPECT_THROW(Fit(mesh, {}), Error);
  EXPECT_THROW(FitOfMesh(mesh, {}, Surfels(1)), Error);
  PointCloud surfels = Surfels(1);
  surfels.radii[3] = 0;
  EXPECT_THROW(Fit(mesh, surfels), Error);
  surfels = Surfels(1);
  surfels.radii.clear();
  EXPECT_THROW(Fit(mesh, surfels), Error);
  surfels = Surfels(1);
  surfels.points[3].x() = std::nanf("");
  EXPECT_THROW(Fit(mesh, surfels), Error);
}

}  // namespace
}  // namespace mono3d
