// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

namespace mono3d::tools {

// How another program ended.
struct ProcessResult {
  int exit_status = -1;  // -1 when it did not exit by itself
  std::string ending;    // "exit 0", "signal 11 (Segmentation fault)", "time limit of 60 s"
  double wall_s = 0;
  double cpu_s = 0;  // user and system
};

// Runs a program to its end; no shell is in between. `log` takes its stdout and stderr. It is
// ended after `time_limit_s` (0: no limit) and when `stop` becomes true, first with SIGTERM, ten
// seconds later with SIGKILL. Throws Error when it cannot be started.
ProcessResult RunProcess(const std::vector<std::string>& command, const std::filesystem::path& log,
                         double time_limit_s, const std::atomic<bool>& stop);

// The folder of the program that runs.
std::filesystem::path ProgramFolder();

}  // namespace mono3d::tools
