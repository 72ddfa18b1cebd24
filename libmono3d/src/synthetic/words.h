// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {

// Throws UsageError unless the option's value is one of the words.
template <std::size_t kCount>
void RequireOneOf(const std::string& option, const std::string& value,
                  const std::array<const char*, kCount>& words) {
  if (std::find(words.begin(), words.end(), value) != words.end()) return;
  std::string expected;
  for (const char* word : words) expected += (expected.empty() ? "" : ", ") + std::string(word);
  throw UsageError(ErrorParts{
      .what = "no such kind", .where = "--" + option, .expected = expected, .found = value});
}

}  // namespace mono3d::synthetic
