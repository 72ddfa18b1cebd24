// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

namespace mono3d {

// What the tools end with.
inline constexpr int kWrongUsage = 2;
inline constexpr int kFailure = 1;

// How a command of the shell ended.
struct CommandResult {
  int exit_status = -1;  // -1 when a signal ended it
  std::string output;    // stdout
  std::string errors;    // stderr
};

// Runs `command` by /bin/sh; `folder` takes what it prints.
CommandResult RunCommand(const std::string& command, const std::filesystem::path& folder);

std::string ReadText(const std::filesystem::path& path);
void WriteText(const std::filesystem::path& path, const std::string& text);

}  // namespace mono3d
