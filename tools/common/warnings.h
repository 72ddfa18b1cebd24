// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mono3d::tools {

// A warning of the library, and how often it came.
struct NotedWarning {
  std::string message;
  std::int64_t times = 0;
};

// Notes one of this process; true the first time. Any thread.
bool NoteWarning(std::string_view message);

// In the order in which they first came; the first 100 different ones.
std::vector<NotedWarning> NotedWarnings();

}  // namespace mono3d::tools
