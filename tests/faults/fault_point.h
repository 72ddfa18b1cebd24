// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace mono3d::faults {

// What MONO3D_FAULT asks for: "KIND:NUMBER" lets the call of this kind and number (from 1) fail,
// "KIND:NUMBER:kill" kills the process instead.
struct Fault {
  char kind[48] = {};
  long number = 0;
  bool is_kill = false;
};

inline const Fault& AskedFault() {
  static const Fault fault = [] {
    Fault result;
    const char* text = std::getenv("MONO3D_FAULT");
    if (text == nullptr) return result;
    char action[8] = {};
    if (std::sscanf(text, "%47[^:]:%ld:%7s", result.kind, &result.number, action) < 2)
      return result;
    result.is_kill = std::strcmp(action, "kill") == 0;
    return result;
  }();
  return fault;
}

// All calls of one kind.
class FaultPoint {
 public:
  explicit constexpr FaultPoint(const char* kind) : kind_(kind) {}

  // Counts one call; whether it is to fail.
  bool IsDue() {
    const long number = ++count_;
    const Fault& fault = AskedFault();
    if (fault.number != number || std::strcmp(fault.kind, kind_) != 0) return false;
    if (fault.is_kill) kill(getpid(), SIGKILL);
    return true;
  }
  const char* kind() const { return kind_; }
  long count() const { return count_; }

 private:
  const char* kind_;
  std::atomic<long> count_ = 0;
};

// Adds "kind count" lines to the file MONO3D_FAULT_COUNTS, where that is asked for.
template <typename Points>
void ReportCounts(const Points& points) {
  const char* path = std::getenv("MONO3D_FAULT_COUNTS");
  if (path == nullptr) return;
  std::FILE* file = std::fopen(path, "a");
  if (file == nullptr) return;
  for (const FaultPoint& point : points)
    std::fprintf(file, "%s %ld\n", point.kind(), point.count());
  std::fclose(file);
}

}  // namespace mono3d::faults
