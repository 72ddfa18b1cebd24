// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/allocator.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <vector>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace mono3d::tools {
namespace {

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
std::size_t BytesFromTheSystem() { return mallinfo2().hblkhd; }

// By default glibc would keep a block of this size after it was freed once.
TEST(Allocator, ReturnsLargeBlocksEachTime) {
  ReturnLargeBlocks();
  constexpr std::size_t kBytes = 20 << 20;
  const std::size_t before = BytesFromTheSystem();
  for (int i = 0; i < 3; ++i) {
    std::vector<char> block(kBytes, 'a');
    EXPECT_GE(BytesFromTheSystem(), before + kBytes) << i;
    block = std::vector<char>();
    EXPECT_EQ(BytesFromTheSystem(), before) << i;
  }
}
#endif

}  // namespace
}  // namespace mono3d::tools
