// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/mesh_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// Hills with a sphere above them, far from the origin, and specks of a few triangles; in an order
// that has nothing to do with the places.
PointCloud HillsAndASphere(std::size_t num_hills) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform;
  std::normal_distribution<float> normal;
  PointCloud cloud;
  const Eigen::Vector3f away(1000, -2000, 300);
  const auto add = [&](const Eigen::Vector3f& point, const Eigen::Vector3f& direction) {
    cloud.points.push_back(point + away);
    cloud.normals.push_back(direction.normalized());
    cloud.radii.push_back(0.04F + 0.02F * uniform(random));
    cloud.confidences.push_back(uniform(random));
    cloud.colours.push_back({static_cast<std::uint8_t>(255 * uniform(random)), 7, 9});
  };
  for (std::size_t i = 0; i < num_hills; ++i) {
    const float x = 8 * uniform(random), y = 5 * uniform(random);
    const float noise = 0.005F * normal(random);
    add({x, y, std::sin(x) * std::cos(y) + noise},
        {-std::cos(x) * std::cos(y), std::sin(x) * std::sin(y), 1});
    const Eigen::Vector3f direction(normal(random), normal(random), normal(random));
    if (i % 4 == 0) add(Eigen::Vector3f(4, 2.5F, 3) + direction.normalized(), direction);
    if (i % 400 == 0) add({x, y, 6 + y}, {0, 0, 1});
  }
  return cloud;
}

class SurfelsInBlocks : public SurfelSource {
 public:
  explicit SurfelsInBlocks(PointCloud cloud) : cloud_(std::move(cloud)) {}

  // Those in the box alone, some hundred at a time.
  void Read(const Eigen::AlignedBox3d& box,
            const std::function<void(const PointCloud&)>& take) override {
    constexpr std::size_t kOfBlock = 300;
    PointCloud block;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      if (!box.contains(cloud_.points[i].cast<double>())) continue;
      block.points.push_back(cloud_.points[i]);
      block.normals.push_back(cloud_.normals[i]);
      block.radii.push_back(cloud_.radii[i]);
      block.confidences.push_back(cloud_.confidences[i]);
      block.colours.push_back(cloud_.colours[i]);
      if (block.size() < kOfBlock) continue;
      take(block);
      block = {};
    }
    if (!block.empty()) take(block);
  }

 private:
  PointCloud cloud_;
};

using Corner = std::array<float, 6>;                // place and normal
using Triangle = std::array<Corner, 3>;             // the least corner first
using Colours = std::array<std::array<int, 3>, 3>;  // in that order

// Whatever order triangles and vertices are in.
std::vector<std::pair<Triangle, Colours>> Soup(const TriangleMesh& mesh) {
  std::vector<std::pair<Triangle, Colours>> soup;
  for (const auto& triangle : mesh.triangles) {
    std::array<std::pair<Corner, std::array<int, 3>>, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = triangle[k];
      const Eigen::Vector3f& p = mesh.vertices[v];
      const Eigen::Vector3f& n = mesh.normals[v];
      const auto& c = mesh.colours[v];
      corners[k] = {{p.x(), p.y(), p.z(), n.x(), n.y(), n.z()}, {c[0], c[1], c[2]}};
    }
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    soup.push_back({{corners[0].first, corners[1].first, corners[2].first},
                    {corners[0].second, corners[1].second, corners[2].second}});
  }
  return soup;
}

TEST(MeshSurfelsInTiles, GivesTheMeshOfTheWholeToTheBit) {
  const PointCloud cloud = HillsAndASphere(8000);
  // Pieces of fewer are some specks; and, in some parts, the ends of the sphere.
  const MeshOptions options{.min_triangles = 60};
  auto whole = Soup(MeshSurfels(cloud, options));
  std::ranges::sort(whole);
  ASSERT_GT(whole.size(), 8000U);
  SurfelsInBlocks source(cloud);
  for (const std::size_t max_surfels : {cloud.size(), cloud.size() / 3, std::size_t{400}}) {
    std::vector<std::pair<Triangle, Colours>> parts;
    std::size_t num_parts = 0;
    const MeshTilesResult result =
        MeshSurfelsInTiles(source, max_surfels, options, [&](const TriangleMesh& part) {
          ++num_parts;
          const auto of_part = Soup(part);
          parts.insert(parts.end(), of_part.begin(), of_part.end());
        });
    EXPECT_EQ(result.num_tiles, num_parts);
    EXPECT_EQ(result.num_triangles, parts.size());
    EXPECT_GE(num_parts, (cloud.size() + max_surfels - 1) / max_surfels);
    std::ranges::sort(parts);
    ASSERT_EQ(parts.size(), whole.size()) << max_surfels;
    EXPECT_TRUE(parts == whole) << max_surfels;
  }
}

TEST(MeshSurfelsInTiles, RefusesWhatCannotBeMeshed) {
  const auto none = [](const TriangleMesh&) {};
  SurfelsInBlocks empty(PointCloud{});
  EXPECT_THROW(MeshSurfelsInTiles(empty, 10, {}, none), Error);
  PointCloud cloud = HillsAndASphere(100);
  cloud.radii[50] = 0;
  SurfelsInBlocks damaged(cloud);
  EXPECT_THROW(MeshSurfelsInTiles(damaged, 10, {}, none), Error);
}

}  // namespace
}  // namespace mono3d
