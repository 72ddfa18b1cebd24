// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/warnings.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "mono3d/core/log.h"

namespace mono3d::tools {
namespace {

constexpr std::size_t kMaxNoted = 100;

struct WarningList {
  std::mutex mutex;
  std::vector<NotedWarning> warnings;
  std::optional<std::vector<std::string>> held;  // while there are HeldWarnings
};

WarningList& Noted() {
  static WarningList list;
  return list;
}

}  // namespace

bool NoteWarning(std::string_view message) {
  WarningList& list = Noted();
  const std::lock_guard lock(list.mutex);
  if (list.held) {
    list.held->emplace_back(message);
    return false;
  }
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

HeldWarnings::HeldWarnings() {
  WarningList& list = Noted();
  const std::lock_guard lock(list.mutex);
  list.held.emplace();
}

HeldWarnings::~HeldWarnings() {
  WarningList& list = Noted();
  const std::lock_guard lock(list.mutex);
  list.held.reset();
}

void HeldWarnings::LetGo() {
  WarningList& list = Noted();
  std::optional<std::vector<std::string>> held;
  {
    const std::lock_guard lock(list.mutex);
    held = std::exchange(list.held, std::nullopt);
  }
  for (const std::string& message : held.value_or(std::vector<std::string>())) {
    Log(LogLevel::kWarning, message);
  }
}

}  // namespace mono3d::tools
