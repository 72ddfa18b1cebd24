// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mono3d {

// What a person may do wrong with the tools.
struct Mistake {
  std::string what;     // "the folder is empty"
  std::string command;  // "reconstruct flight -o out": a tool without "mono3d-", and its arguments
  int status;           // of the tool
  std::string cause;    // part of the message: names what is wrong
  std::string remedy;   // part of the message: what is expected, or what to do
};

const std::vector<Mistake>& Mistakes();

// The files that the commands name, below `folder`.
void WriteFilesOfMistakes(const std::filesystem::path& folder);

}  // namespace mono3d
