// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "tracking/map/map.h"

namespace mono3d::tracking {

// Points of one map that have been come across; valid until the map gets new ones.
class PointSet {
 public:
  explicit PointSet(const Map& map) : is_in_(map.points().size(), 0) {}

  // False where the point was in the set already.
  bool Insert(PointId point) {
    char& is_in = is_in_[point.index];
    if (is_in != 0) return false;
    is_in = 1;
    return true;
  }

 private:
  std::vector<char> is_in_;  // by index
};

}  // namespace mono3d::tracking
