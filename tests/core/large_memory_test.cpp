// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/large_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

namespace mono3d {
namespace {

TEST(LargeMemory, IsEmptyOfItself) {
  const LargeMemory memory;
  EXPECT_EQ(memory.data(), nullptr);
  EXPECT_EQ(memory.size(), 0U);
}

TEST(LargeMemory, IsZeroAndAtWholePages) {
  constexpr std::size_t kBytes = (std::size_t{3} << 20) + 1;
  constexpr std::uintptr_t kPageBytes = 4096;
  const LargeMemory memory(kBytes);
  ASSERT_NE(memory.data(), nullptr);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory.data()) % kPageBytes, 0U);
  EXPECT_EQ(memory.size() % kPageBytes, 0U);
  ASSERT_GE(memory.size(), kBytes);
  const std::span<const std::byte> bytes(memory.data(), memory.size());
  EXPECT_TRUE(std::ranges::all_of(bytes, [](std::byte byte) { return byte == std::byte{0}; }));
}

TEST(LargeMemory, GoesWithWhoeverItIsMovedTo) {
  LargeMemory memory(std::size_t{1} << 20);
  std::byte* const data = memory.data();
  data[5] = std::byte{7};
  LargeMemory moved = std::move(memory);
  EXPECT_EQ(moved.data(), data);
  LargeMemory assigned;
  assigned = std::move(moved);
  EXPECT_EQ(assigned.data(), data);
  EXPECT_EQ(assigned.data()[5], std::byte{7});
}

TEST(LargeMemory, IsEmptyWhereThereIsNone) {
  EXPECT_EQ(LargeMemory(std::size_t{1} << 60).data(), nullptr);
}

}  // namespace
}  // namespace mono3d
