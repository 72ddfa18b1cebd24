// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/write_failures.h"

#include <exception>

#include "common/tool.h"
#include "mono3d/core/log.h"
#include "reconstruct/processing.h"

namespace mono3d::tools {

void WriteFailures::Try(const std::string& kind, const std::function<void()>& step) {
  try {
    step();
  } catch (const std::exception& error) {
    const std::string words = WordsOf(error);
    const std::lock_guard lock(mutex_);
    Failures& failures = by_kind_[kind];
    if (++failures.num > 1) return;
    failures.first = words;
    Log(LogLevel::kWarning, words + "; the run goes on");
  }
}

void WriteFailures::NoteIn(RunRecord& record) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [kind, failures] : by_kind_) {
    NoteFailure(
        std::to_string(failures.num) + " " + kind + " could not be written: " + failures.first,
        record);
  }
}

}  // namespace mono3d::tools
