// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/disjoint_sets.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

namespace mono3d {
namespace {

TEST(DisjointSets, AreTheSameInWhicheverOrderTheyAreJoined) {
  std::vector<std::pair<int, int>> pairs = {{5, 3}, {8, 9}, {3, 7}, {9, 5}, {2, 6}};
  for (int turn = 0; turn < 2; ++turn) {
    DisjointSets<std::uint32_t> sets(10);
    for (const auto& [a, b] : pairs) {
      sets.Join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
    }
    std::vector<std::uint32_t> leaders;
    for (std::uint32_t i = 0; i < 10; ++i) leaders.push_back(sets.Find(i));
    EXPECT_EQ(leaders, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 3, 2, 3, 3, 3}));
    std::swap(pairs.front(), pairs.back());
  }
}

TEST(DisjointSets, GrowByOneNumberAtATime) {
  DisjointSets<std::uint32_t> sets;
  EXPECT_EQ(sets.Add(), 0U);
  EXPECT_EQ(sets.Add(), 1U);
  EXPECT_EQ(sets.Find(1), 1U);
  EXPECT_EQ(sets.Join(1, 0), 0U);
  EXPECT_EQ(sets.Find(1), 0U);
  EXPECT_EQ(sets.Join(1, 0), 0U) << "they were one already";
  EXPECT_EQ(sets.size(), 2U);
}

}  // namespace
}  // namespace mono3d
