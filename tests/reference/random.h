// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace mono3d {

// Random numbers for tests. The distributions of the standard library may differ from one library
// to the next, these do not.

// Seeds follow from the name of the running test, so that tests do not share their luck.
inline unsigned SeedFromTestName() {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  unsigned hash = 2166136261U;  // FNV-1a
  for (const char c : std::string(test->test_suite_name()) + "." + test->name()) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  }
  return hash;
}

inline double Uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) / 4294967295.0;
}

inline double Normal(std::mt19937& random, double sigma) {
  double sum = 0;  // twelve uniform numbers have the variance 1
  for (int i = 0; i < 12; ++i) sum += Uniform(random, -0.5, 0.5);
  return sigma * sum;
}

}  // namespace mono3d
