// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "mono3d/pipeline/run_writer.h"

namespace mono3d::tools {

// Files that could not be written while a run went on. Any thread.
class WriteFailures {
 public:
  // Runs `step`, which writes a file of this kind ("depth maps"); where it throws, the run goes on,
  // and the first failure of the kind is logged.
  void Try(const std::string& kind, const std::function<void()>& step);
  // The run failed by them, unless it had failed before or there are none.
  void NoteIn(RunRecord& record) const;

 private:
  struct Failures {
    std::int64_t num = 0;
    std::string first;
  };
  mutable std::mutex mutex_;
  std::map<std::string, Failures> by_kind_;
};

}  // namespace mono3d::tools
