// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/isolated_surfels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

using NeighbourCell = std::array<std::int32_t, 3>;

constexpr std::int32_t kMaxReach = 32;  // in cells
// A cell's number along an axis: three of them fit into 64 bits. No scene is so wide at this
// resolution, three radii a cell.
constexpr std::int32_t kMaxCell = (1 << 20) - 1 - kMaxReach;

// The first surfel of each cell, in one piece of memory: entries lie where their hash says or
// behind.
class FirstOfCells {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  std::uint32_t Find(const NeighbourCell& cell) const {
    const std::uint64_t key = KeyOf(cell);
    for (std::size_t at = PlaceOf(key);; at = (at + 1) & mask_) {
      if (entries_[at].first == kNone || entries_[at].key == key) return entries_[at].first;
    }
  }
  // Returns what was there before.
  std::uint32_t Exchange(const NeighbourCell& cell, std::uint32_t first) {
    if (3 * (num_ + 1) > 2 * entries_.size()) Grow();
    Entry& entry = EntryOf(KeyOf(cell));
    num_ += entry.first == kNone ? 1 : 0;
    return std::exchange(entry.first, first);
  }

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::uint32_t first = kNone;
  };

  static std::uint64_t KeyOf(const NeighbourCell& cell) {
    std::uint64_t key = 0;
    for (const std::int32_t number : cell) {
      key = (key << 21) | (static_cast<std::uint32_t>(number) & 0x1FFFFFU);
    }
    return key;
  }
  std::size_t PlaceOf(std::uint64_t key) const {
    key ^= key >> 31;
    key *= 0x9E3779B97F4A7C15U;  // the golden ratio's: mixes all bits
    return static_cast<std::size_t>(key ^ (key >> 29)) & mask_;
  }
  Entry& EntryOf(std::uint64_t key) {
    std::size_t at = PlaceOf(key);
    while (entries_[at].first != kNone && entries_[at].key != key) at = (at + 1) & mask_;
    entries_[at].key = key;
    return entries_[at];
  }
  void Grow() {
    const std::vector<Entry> before = std::exchange(entries_, {});
    entries_.resize(2 * before.size());
    mask_ = entries_.size() - 1;
    for (const Entry& entry : before) {
      if (entry.first != kNone) EntryOf(entry.key).first = entry.first;
    }
  }

  std::vector<Entry> entries_ = std::vector<Entry>(1024);  // a power of two
  std::size_t mask_ = 1023;
  std::size_t num_ = 0;
};

class Neighbourhood {
 public:
  explicit Neighbourhood(const PointCloud& surfels) : surfels_(surfels) {
    edge_ = kNeighbourRadii * UpperMedian(surfels.radii);
    next_.resize(surfels.size());
    for (std::uint32_t i = 0; i < surfels.size(); ++i) {
      const std::uint32_t before = first_.Exchange(CellOf(surfels.points[i]), i);
      next_[i] = before == FirstOfCells::kNone ? i : before;  // the last points to itself
    }
  }

  // Whether so many surfels are `within` of the point, itself if it is one. A reach beyond
  // kMaxReach counts as enough.
  bool Has(int num_surfels, const Eigen::Vector3f& point, double within) const {
    const auto reach = static_cast<std::int32_t>(std::ceil(std::min(within / edge_, 1e6)));
    if (reach > kMaxReach) return true;
    int count = 0;
    // From near to far: most have enough in the cells next to them.
    for (std::int32_t ring = 0; ring <= reach; ++ring) {
      count += CountInRing(point, ring, within * within, num_surfels - count);
      if (count >= num_surfels) return true;
    }
    return false;
  }

 private:
  NeighbourCell CellOf(const Eigen::Vector3f& point) const {
    NeighbourCell cell{};
    for (int axis = 0; axis < 3; ++axis) {
      const double index = std::clamp(std::floor(static_cast<double>(point[axis]) / edge_),
                                      -double(kMaxCell), double(kMaxCell));
      cell.at(static_cast<std::size_t>(axis)) = static_cast<std::int32_t>(index);
    }
    return cell;
  }

  // In the cells that lie `ring` cells away along the axis along which they lie farthest; stops at
  // `enough`.
  int CountInRing(const Eigen::Vector3f& point, std::int32_t ring, double squared_distance,
                  int enough) const {
    const NeighbourCell middle = CellOf(point);
    int count = 0;
    for (std::int32_t x = -ring; x <= ring; ++x) {
      for (std::int32_t y = -ring; y <= ring; ++y) {
        const bool is_side = std::abs(x) == ring || std::abs(y) == ring;
        const std::int32_t step = is_side ? 1 : std::max<std::int32_t>(1, 2 * ring);
        for (std::int32_t z = -ring; z <= ring; z += step) {
          const std::uint32_t first = first_.Find({middle[0] + x, middle[1] + y, middle[2] + z});
          if (first == FirstOfCells::kNone) continue;
          count += CountInCell(point, first, squared_distance);
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
  FirstOfCells first_;
  std::vector<std::uint32_t> next_;  // surfel in the same cell
};

// What holds of each from `first` on, found by all processors.
template <typename Holds>
std::vector<bool> ForEach(std::size_t num, std::size_t first, const Holds& holds) {
  std::vector<bool> of_all(num, false);
  // Bits lie 64 to a word of memory, which only one thread may write.
  constexpr std::size_t kPart = 1 << 14;
  const auto num_parts = static_cast<int>((num + kPart - 1) / kPart);
  cv::parallel_for_({0, num_parts}, [&](const cv::Range& parts) {
    const auto begin = std::max(first, static_cast<std::size_t>(parts.start) * kPart);
    const auto end = std::min(num, static_cast<std::size_t>(parts.end) * kPart);
    for (std::size_t i = begin; i < end; ++i) of_all[i] = holds(i);
  });
  return of_all;
}

}  // namespace

std::vector<bool> FindIsolated(const PointCloud& surfels, int min_neighbours, std::size_t first) {
  if (surfels.empty() || min_neighbours <= 0) return std::vector<bool>(surfels.size(), false);
  const Neighbourhood neighbourhood(surfels);
  return ForEach(surfels.size(), first, [&](std::size_t i) {
    // Each finds itself.
    return !neighbourhood.Has(min_neighbours + 1, surfels.points[i],
                              kNeighbourRadii * surfels.radii[i]);
  });
}

std::vector<bool> FindNear(const PointCloud& surfels, const PointCloud& others, double radii) {
  if (others.empty()) return std::vector<bool>(surfels.size(), false);
  const Neighbourhood neighbourhood(others);
  return ForEach(surfels.size(), 0, [&](std::size_t i) {
    return neighbourhood.Has(1, surfels.points[i], radii * surfels.radii[i]);
  });
}

}  // namespace mono3d
