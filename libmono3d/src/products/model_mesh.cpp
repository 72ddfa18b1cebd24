// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/model_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geometry/mesh_tiles.h"
#include "mono3d/io/ply_reader.h"
#include "mono3d/products/mesh_decimation.h"

namespace mono3d {
namespace {

// Parts are first decimated to so many times the triangles that are asked for: the last step then
// still chooses freely, over the borders between them as well.
constexpr double kShareOfParts = 4;
// Of the triangles of a mesh over the surfels of its model (two cells' worth to a surfel).
constexpr double kTrianglesOfSurfel = 2;

// Blocks of model.ply; those that a box does not touch are passed over.
class FileOfSurfels : public SurfelSource {
 public:
  explicit FileOfSurfels(const std::filesystem::path& model) : model_(model), reader_(model) {
    if (reader_.size() == 0) {
      throw Error(ErrorParts{.what = "the model is empty",
                             .where = model.string(),
                             .expected = "surfels",
                             .found = "none"});
    }
    PointCloud block;
    while (reader_.Read(kSurfelsOfBlock, block) > 0) {
      Eigen::AlignedBox3f& bounds = bounds_.emplace_back();
      for (const Eigen::Vector3f& point : block.points) {
        if (point.allFinite()) bounds.extend(point);
      }
    }
  }

  std::size_t size() const { return reader_.size(); }

  void Read(const Eigen::AlignedBox3d& box,
            const std::function<void(const PointCloud&)>& take) override {
    PointCloud block;
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      if (!box.intersects(bounds_[i].cast<double>())) continue;
      reader_.Seek(i * kSurfelsOfBlock);
      reader_.Read(kSurfelsOfBlock, block);
      take(block);
    }
  }

 private:
  static constexpr std::size_t kSurfelsOfBlock = std::size_t{1} << 14;

  std::filesystem::path model_;
  PlyReader reader_;
  std::vector<Eigen::AlignedBox3f> bounds_;
};

// Puts parts together that have vertices in common, with the same bits.
class Welder {
 public:
  void Add(const TriangleMesh& part) {
    std::vector<std::uint32_t> index(part.vertices.size());
    for (std::size_t v = 0; v < part.vertices.size(); ++v) {
      const Eigen::Vector3f& p = part.vertices[v];
      const auto [entry, is_new] = vertex_at_.try_emplace(
          {std::bit_cast<std::int32_t>(p.x()), std::bit_cast<std::int32_t>(p.y()),
           std::bit_cast<std::int32_t>(p.z())},
          static_cast<std::uint32_t>(mesh_.vertices.size()));
      index[v] = entry->second;
      if (!is_new) continue;
      mesh_.vertices.push_back(p);
      mesh_.normals.push_back(part.normals[v]);
      if (!part.colours.empty()) mesh_.colours.push_back(part.colours[v]);
    }
    for (const auto& [a, b, c] : part.triangles) {
      mesh_.triangles.push_back({index[a], index[b], index[c]});
    }
  }

  TriangleMesh Take() { return std::move(mesh_); }

 private:
  TriangleMesh mesh_;
  std::map<std::array<std::int32_t, 3>, std::uint32_t> vertex_at_;
};

}  // namespace

ModelMesh MakeModelMesh(const std::filesystem::path& model, const ModelMeshOptions& options) {
  FileOfSurfels surfels(model);
  ModelMesh result;
  TriangleMesh whole;
  MeshTilesResult tiles;
  if (surfels.size() <= options.max_surfels_of_part) {
    tiles = MeshSurfelsInTiles(surfels, surfels.size(), options.mesh,
                               [&](TriangleMesh part) { whole = std::move(part); });
  } else {
    Welder welder;
    const double of_triangle = kShareOfParts * static_cast<double>(options.max_triangles) /
                               (kTrianglesOfSurfel * static_cast<double>(surfels.size()));
    tiles = MeshSurfelsInTiles(
        surfels, options.max_surfels_of_part, options.mesh, [&](TriangleMesh part) {
          const double share = std::ceil(of_triangle * static_cast<double>(part.triangles.size()));
          const DecimatedMesh smaller =
              Decimate(part, static_cast<std::size_t>(share), /*keeps_borders=*/true);
          part = {};
          result.error_su = std::max(result.error_su, smaller.error_su);
          welder.Add(smaller.mesh);
        });
    whole = welder.Take();
  }
  result.num_parts = tiles.num_tiles;
  result.num_triangles = tiles.num_triangles;
  result.median_radius_su = tiles.median_radius_su;
  DecimatedMesh decimated = Decimate(whole, options.max_triangles);
  result.mesh = std::move(decimated.mesh);
  // The surface has moved by one and then by the other.
  result.error_su += decimated.error_su;
  return result;
}

}  // namespace mono3d
