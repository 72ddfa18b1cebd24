// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/descriptor.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <vector>

#include "reference/random.h"

namespace mono3d::tracking {
namespace {

TEST(DescriptorDistance, CountsBitsByHand) {
  EXPECT_EQ(Distance({0, 0, 0, 0}, {1, 0, 3, 0x8000000000000000U}), 4);
  EXPECT_EQ(Distance({0, 0, 0, 0}, {~0ULL, ~0ULL, ~0ULL, ~0ULL}), kDescriptorBits);
}

TEST(DescriptorDistance, EqualsTheCountOfEachWord) {
  std::mt19937_64 random(SeedFromTestName());
  for (int i = 0; i < 1000; ++i) {
    Descriptor a;
    Descriptor b;
    int expected = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      a[k] = random() & random();
      b[k] = random() | random();
      expected += std::popcount(a[k] ^ b[k]);
    }
    ASSERT_EQ(Distance(a, b), expected);
  }
}

TEST(MostTypical, IsTheOneAmongItsLikes) {
  const std::vector<Descriptor> descriptors = {
      {0xffff, 0, 0, 0}, {1, 0, 0, 0}, {3, 0, 0, 0}, {7, 0, 0, 0}};
  EXPECT_EQ(MostTypical(descriptors), 1U);  // distances 15 0 1 2: the lower median is 1
  EXPECT_EQ(MostTypical(std::vector<Descriptor>(1)), 0U);
}

}  // namespace
}  // namespace mono3d::tracking
