// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/mesh_tiles.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/disjoint_sets.h"
#include "geometry/mesh_pieces.h"
#include "geometry/surfel_grid.h"
#include "geometry/surfel_marcher.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// Parts are made of cubes of so many cells: far more than a surfel reaches, far fewer than a part.
constexpr std::int32_t kCellsOfCube = 16;
static_assert(kCellsOfCube > kFarthestReach);

struct CountedCube {
  GridIndex index{};  // in cubes
  std::size_t num_surfels = 0;
};

const Eigen::AlignedBox3d& AllSurfels() {
  static const Eigen::AlignedBox3d kAll(
      Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity()),
      Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()));
  return kAll;
}

// What is known of a model before any of it is meshed.
struct ModelExtent {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // the first surfel, as of SurfelGrid
  double median_radius_su = 0;
  double voxel_su = 0;
  bool has_colours = false;
  std::vector<CountedCube> cubes;
};

ModelExtent ExtentOf(SurfelSource& surfels, const MeshOptions& options) {
  ModelExtent extent;
  std::vector<float> radii;
  surfels.Read(AllSurfels(), [&](const PointCloud& block) {
    if (block.empty()) return;
    RequireMeshable(block);
    if (radii.empty()) {
      extent.origin = block.points.front().cast<double>();
      extent.has_colours = !block.colours.empty();
    }
    radii.insert(radii.end(), block.radii.begin(), block.radii.end());
  });
  if (radii.empty()) RequireMeshable({});
  extent.median_radius_su = UpperMedian(std::move(radii));
  extent.voxel_su = options.voxel_radii * extent.median_radius_su;
  std::unordered_map<GridIndex, std::size_t, GridIndexHash> counts;
  surfels.Read(AllSurfels(), [&](const PointCloud& block) {
    for (const Eigen::Vector3f& point : block.points) {
      const Eigen::Vector3d at = (point.cast<double>() - extent.origin) / extent.voxel_su;
      if (!(at.cwiseAbs().maxCoeff() < kFarthestIndex)) continue;
      const Eigen::Vector3i cube = (at / kCellsOfCube).array().floor().cast<int>();
      ++counts[{cube.x(), cube.y(), cube.z()}];
    }
  });
  for (const auto& [index, count] : counts) extent.cubes.push_back({index, count});
  std::ranges::sort(extent.cubes, {}, &CountedCube::index);
  return extent;
}

// Cuts a box of cubes (`last` not included) between cubes until each part has few enough surfels.
class Partition {
 public:
  explicit Partition(std::size_t max_surfels) : max_surfels_(max_surfels) {}

  void Split(std::vector<CountedCube> cubes, const GridBox& box) {
    std::size_t num_surfels = 0;
    for (const CountedCube& cube : cubes) num_surfels += cube.num_surfels;
    if (cubes.empty()) return;
    const std::optional<std::pair<std::size_t, std::int32_t>> cut =
        num_surfels <= max_surfels_ ? std::nullopt : CutOf(cubes, num_surfels);
    if (!cut) {
      parts_.push_back(box);
      return;
    }
    const auto [axis, at] = *cut;
    std::vector<CountedCube> below, above;
    for (const CountedCube& cube : cubes) {
      (cube.index.at(axis) < at ? below : above).push_back(cube);
    }
    cubes = {};
    GridBox lower = box, upper = box;
    lower.last.at(axis) = upper.first.at(axis) = at;
    Split(std::move(below), lower);
    Split(std::move(above), upper);
  }

  const std::vector<GridBox>& parts() const { return parts_; }

 private:
  // Across the longest way, where half of the surfels are on each side; nothing of a single cube.
  static std::optional<std::pair<std::size_t, std::int32_t>> CutOf(std::vector<CountedCube>& cubes,
                                                                   std::size_t num_surfels) {
    std::size_t longest = 0;
    std::int32_t length = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::ranges::minmax(
          cubes, {}, [&](const CountedCube& cube) { return cube.index.at(axis); });
      const std::int32_t extent = most.index.at(axis) - least.index.at(axis);
      if (extent <= length) continue;
      length = extent;
      longest = axis;
    }
    if (length == 0) return std::nullopt;
    std::ranges::sort(cubes, {}, [&](const CountedCube& cube) { return cube.index.at(longest); });
    const std::int32_t first = cubes.front().index.at(longest);
    std::size_t num_below = 0;
    for (const CountedCube& cube : cubes) {
      const std::int32_t at = cube.index.at(longest);
      if (at > first && 2 * num_below >= num_surfels) return std::pair(longest, at);
      num_below += cube.num_surfels;
    }
    return std::pair(longest, cubes.back().index.at(longest));
  }

  std::size_t max_surfels_;
  std::vector<GridBox> parts_;
};

// In corners of the grid; parts that meet have the plane between them both.
std::vector<GridBox> PartsOf(const ModelExtent& extent, std::size_t max_surfels) {
  GridBox all{{kFarthestIndex, kFarthestIndex, kFarthestIndex},
              {-kFarthestIndex, -kFarthestIndex, -kFarthestIndex}};
  for (const CountedCube& cube : extent.cubes) {
    for (std::size_t k = 0; k < 3; ++k) {
      // With what surfels at its border reach.
      all.first.at(k) = std::min(all.first.at(k), cube.index.at(k) - 1);
      all.last.at(k) = std::max(all.last.at(k), cube.index.at(k) + 2);
    }
  }
  Partition partition(max_surfels);
  partition.Split(extent.cubes, all);
  std::vector<GridBox> parts = partition.parts();
  for (GridBox& part : parts) {
    for (std::size_t k = 0; k < 3; ++k) {
      part.first.at(k) *= kCellsOfCube;
      part.last.at(k) *= kCellsOfCube;
    }
  }
  return parts;
}

// The connected pieces of the mesh of the whole, which hang together over the planes between parts.
class PiecesOfParts {
 public:
  explicit PiecesOfParts(std::size_t min_triangles) : min_triangles_(min_triangles) {}

  // The pieces of a part that are large enough by themselves. Of the others those that reach
  // another part are kept until they are known as wholes.
  TriangleMesh Add(const TriangleMesh& mesh, const std::vector<char>& is_on_border) {
    const std::vector<std::uint32_t> piece = FindPieces(mesh);
    const std::vector<std::size_t> num_triangles = CountTrianglesOfPieces(mesh, piece);
    std::unordered_map<std::uint32_t, std::uint32_t> shared;  // number of those at a border
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
      if (is_on_border[v] == 0) continue;
      const auto [entry, is_new] =
          shared.try_emplace(piece[v], static_cast<std::uint32_t>(pieces_.size()));
      if (is_new) {
        (void)pieces_.Add();
        total_.push_back(num_triangles[piece[v]]);
      }
      const auto [met, is_first] = piece_at_.try_emplace(KeyOf(mesh.vertices[v]), entry->second);
      if (!is_first) Join(met->second, entry->second);
    }
    const auto is_large = [&](std::uint32_t number) {
      return num_triangles[number] >= min_triangles_;
    };
    KeepUndecided(mesh, [&](std::uint32_t v) -> std::optional<std::uint32_t> {
      const auto found = is_large(piece[v]) ? shared.end() : shared.find(piece[v]);
      return found == shared.end() ? std::nullopt : std::optional(found->second);
    });
    return PiecesOf(mesh, piece, is_large);
  }

  // Of those kept, what belongs to a piece that is large enough.
  TriangleMesh TakeRest() {
    return PiecesOf(rest_, piece_of_rest_, [&](std::uint32_t number) {
      return total_[pieces_.Find(number)] >= min_triangles_;
    });
  }

 private:
  using Key = std::array<std::int32_t, 3>;  // the bits of a vertex

  static Key KeyOf(const Eigen::Vector3f& vertex) {
    return {std::bit_cast<std::int32_t>(vertex.x()), std::bit_cast<std::int32_t>(vertex.y()),
            std::bit_cast<std::int32_t>(vertex.z())};
  }

  // The triangles whose vertices have a number.
  void KeepUndecided(const TriangleMesh& mesh,
                     const std::function<std::optional<std::uint32_t>(std::uint32_t)>& number_of) {
    std::unordered_map<std::uint32_t, std::uint32_t> new_index;
    for (const auto& triangle : mesh.triangles) {
      const std::optional<std::uint32_t> number = number_of(triangle[0]);
      if (!number) continue;
      std::array<std::uint32_t, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = triangle.at(k);
        const auto [entry, is_new] =
            new_index.try_emplace(v, static_cast<std::uint32_t>(rest_.vertices.size()));
        corners.at(k) = entry->second;
        if (!is_new) continue;
        rest_.vertices.push_back(mesh.vertices[v]);
        rest_.normals.push_back(mesh.normals[v]);
        if (!mesh.colours.empty()) rest_.colours.push_back(mesh.colours[v]);
        piece_of_rest_.push_back(*number);
      }
      rest_.triangles.push_back(corners);
    }
  }

  void Join(std::uint32_t a, std::uint32_t b) {
    a = pieces_.Find(a);
    b = pieces_.Find(b);
    if (a == b) return;
    const std::size_t sum = total_[a] + total_[b];
    total_[pieces_.Join(a, b)] = sum;
  }

  std::size_t min_triangles_;
  DisjointSets<std::uint32_t> pieces_;
  std::vector<std::size_t> total_;  // triangles of each set, at its leader
  std::unordered_map<Key, std::uint32_t, GridIndexHash> piece_at_;
  TriangleMesh rest_;                         // undecided
  std::vector<std::uint32_t> piece_of_rest_;  // of each vertex
};

// Where the surfels are that reach a part.
Eigen::AlignedBox3d BoxOf(const GridBox& part, const ModelExtent& extent) {
  const auto at = [&](const GridIndex& index, int reach) -> Eigen::Vector3d {
    const Eigen::Vector3d cells(index[0] + reach, index[1] + reach, index[2] + reach);
    return extent.origin + extent.voxel_su * cells;
  };
  // One more: what rounding may take away.
  return {at(part.first, -kFarthestReach - 1), at(part.last, kFarthestReach + 1)};
}

}  // namespace

MeshTilesResult MeshSurfelsInTiles(SurfelSource& surfels, std::size_t max_surfels,
                                   const MeshOptions& options,
                                   const std::function<void(TriangleMesh part)>& take) {
  options.Validate();
  const ModelExtent extent = ExtentOf(surfels, options);
  MeshTilesResult result;
  result.median_radius_su = extent.median_radius_su;
  PiecesOfParts pieces(static_cast<std::size_t>(options.min_triangles));
  const auto hand_out = [&](TriangleMesh mesh) {
    if (mesh.triangles.empty()) return;
    ++result.num_tiles;
    result.num_triangles += mesh.triangles.size();
    take(std::move(mesh));
  };
  for (const GridBox& part : PartsOf(extent, std::max<std::size_t>(1, max_surfels))) {
    TriangleMesh mesh;
    {
      SurfelGrid grid(extent.origin, extent.voxel_su, part);
      surfels.Read(BoxOf(part, extent), [&](const PointCloud& block) { grid.Add(block); });
      grid.Finish();
      SurfelMarcher marcher(grid, extent.has_colours);
      mesh = marcher.March();
      mesh = pieces.Add(mesh, marcher.is_on_border());
    }
    hand_out(std::move(mesh));
  }
  hand_out(pieces.TakeRest());
  return result;
}

}  // namespace mono3d
