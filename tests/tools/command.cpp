// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tools/command.h"

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace mono3d {

CommandResult RunCommand(const std::string& command, const std::filesystem::path& folder) {
  const std::filesystem::path output = folder / "stdout.txt";
  const std::filesystem::path errors = folder / "stderr.txt";
  const std::string line =
      "( " + command + " ) >" + output.string() + " 2>" + errors.string() + " </dev/null";
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadText(output), ReadText(errors)};
}

std::string ReadText(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

}  // namespace mono3d
