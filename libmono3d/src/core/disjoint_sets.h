// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace mono3d {

// Union-find over the numbers 0 to n - 1, with path halving. The smallest number of a set leads it,
// so that the sets do not depend on the order of the calls.
template <typename Number>
class DisjointSets {
 public:
  DisjointSets() = default;
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), Number{0});
  }
  // A set of one more number, which is returned.
  Number Add() {
    parent_.push_back(static_cast<Number>(parent_.size()));
    return parent_.back();
  }
  // The leader.
  Number Find(Number x) {
    while (parent_[x] != x) x = parent_[x] = parent_[parent_[x]];
    return x;
  }
  // The one that leads both from now on.
  Number Join(Number a, Number b) {
    a = Find(a);
    b = Find(b);
    return parent_[std::max(a, b)] = std::min(a, b);
  }
  std::size_t size() const { return parent_.size(); }

 private:
  std::vector<Number> parent_;
};

}  // namespace mono3d
