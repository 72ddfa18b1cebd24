// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/isolated_surfels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <unordered_map>

#include "geometry/cell_hash.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

using NeighbourCell = std::array<std::int64_t, 3>;

constexpr std::int64_t kMaxReach = 32;  // in cells

// Footprints of pixels lie apart by this share of a surfel's radius.
constexpr double kFootprintRadii = 0.7071;

class Neighbourhood {
 public:
  explicit Neighbourhood(const PointCloud& surfels) : surfels_(surfels) {
    edge_ = kNeighbourRadii * UpperMedian(surfels.radii);
    next_.resize(surfels.size());
    for (std::uint32_t i = 0; i < surfels.size(); ++i) {
      const auto [first, is_new] = first_.try_emplace(CellOf(surfels.points[i]), i);
      next_[i] = is_new ? i : first->second;  // the last of a cell points to itself
      first->second = i;
    }
  }

  // Whether so many surfels are `within` of the point, itself if it is one. A reach beyond
  // kMaxReach counts as enough.
  bool Has(int num_surfels, const Eigen::Vector3f& point, double within) const {
    const auto reach = static_cast<std::int64_t>(std::ceil(std::min(within / edge_, 1e6)));
    if (reach > kMaxReach) return true;
    int count = 0;
    // From near to far: most have enough in the cells next to them.
    for (std::int64_t ring = 0; ring <= reach; ++ring) {
      count += CountInRing(point, ring, within * within, num_surfels - count);
      if (count >= num_surfels) return true;
    }
    return false;
  }

 private:
  NeighbourCell CellOf(const Eigen::Vector3f& point) const {
    NeighbourCell cell{};
    for (int axis = 0; axis < 3; ++axis) {
      // No scene is so wide at this resolution.
      const double index = std::clamp(static_cast<double>(point[axis]) / edge_, -1e15, 1e15);
      cell.at(static_cast<std::size_t>(axis)) = static_cast<std::int64_t>(std::floor(index));
    }
    return cell;
  }

  // In the cells that lie `ring` cells away along the axis along which they lie farthest; stops at
  // `enough`.
  int CountInRing(const Eigen::Vector3f& point, std::int64_t ring, double squared_distance,
                  int enough) const {
    const NeighbourCell middle = CellOf(point);
    int count = 0;
    for (std::int64_t x = -ring; x <= ring; ++x) {
      for (std::int64_t y = -ring; y <= ring; ++y) {
        const bool is_side = std::abs(x) == ring || std::abs(y) == ring;
        const std::int64_t step = is_side ? 1 : std::max<std::int64_t>(1, 2 * ring);
        for (std::int64_t z = -ring; z <= ring; z += step) {
          const auto first = first_.find({middle[0] + x, middle[1] + y, middle[2] + z});
          if (first == first_.end()) continue;
          count += CountInCell(point, first->second, squared_distance);
          if (count >= enough) return count;
        }
      }
    }
    return count;
  }

  int CountInCell(const Eigen::Vector3f& point, std::uint32_t first,
                  double squared_distance) const {
    int count = 0;
    for (std::uint32_t other = first;; other = next_[other]) {
      const double squared = (surfels_.points[other] - point).squaredNorm();
      count += squared <= squared_distance ? 1 : 0;
      if (next_[other] == other) return count;
    }
  }

  const PointCloud& surfels_;
  double edge_ = 0;
  std::unordered_map<NeighbourCell, std::uint32_t, CellHash<3>> first_;
  std::vector<std::uint32_t> next_;  // surfel in the same cell
};

}  // namespace

std::vector<bool> FindIsolated(const PointCloud& surfels, int min_neighbours, std::size_t first) {
  std::vector<bool> is_isolated(surfels.size(), false);
  if (surfels.empty() || min_neighbours <= 0) return is_isolated;
  const Neighbourhood neighbourhood(surfels);
  for (std::size_t i = first; i < surfels.size(); ++i) {
    // Each finds itself.
    is_isolated[i] = !neighbourhood.Has(min_neighbours + 1, surfels.points[i],
                                        kNeighbourRadii * surfels.radii[i]);
  }
  return is_isolated;
}

std::vector<bool> FindInPlaceOfOthers(const PointCloud& surfels, const PointCloud& others) {
  std::vector<bool> is_in_place(surfels.size(), false);
  if (others.empty()) return is_in_place;
  const Neighbourhood neighbourhood(others);
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    is_in_place[i] = neighbourhood.Has(1, surfels.points[i], kFootprintRadii * surfels.radii[i]);
  }
  return is_in_place;
}

}  // namespace mono3d
