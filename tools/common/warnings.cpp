// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/warnings.h"

#include <algorithm>
#include <mutex>

namespace mono3d::tools {
namespace {

constexpr std::size_t kMaxNoted = 100;

struct WarningList {
  std::mutex mutex;
  std::vector<NotedWarning> warnings;
};

WarningList& Noted() {
  static WarningList list;
  return list;
}

}  // namespace

bool NoteWarning(std::string_view message) {
  WarningList& list = Noted();
  const std::lock_guard lock(list.mutex);
  const auto known = std::ranges::find(list.warnings, message, &NotedWarning::message);
  if (known != list.warnings.end()) {
    ++known->times;
    return false;
  }
  if (list.warnings.size() < kMaxNoted) list.warnings.push_back({std::string(message), 1});
  return true;
}

std::vector<NotedWarning> NotedWarnings() {
  WarningList& list = Noted();
  const std::lock_guard lock(list.mutex);
  return list.warnings;
}

}  // namespace mono3d::tools
