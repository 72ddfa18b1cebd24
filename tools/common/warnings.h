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

// Notes one of this process; true the first time, unless it is held back (HeldWarnings). Any
// thread.
bool NoteWarning(std::string_view message);

// In the order in which they first came; the first 100 different ones.
std::vector<NotedWarning> NotedWarnings();

// While there is one, warnings are neither said nor noted, for what they are of may come to
// nothing. One at a time.
class HeldWarnings {
 public:
  HeldWarnings();
  ~HeldWarnings();  // drops what was not let go
  HeldWarnings(const HeldWarnings&) = delete;
  HeldWarnings& operator=(const HeldWarnings&) = delete;

  // Says and notes them; nothing is held from now on.
  void LetGo();
};

}  // namespace mono3d::tools
