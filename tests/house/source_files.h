// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mono3d::house {

// A text file of the source tree.
struct SourceFile {
  std::string path;  // relative to the root of the tree, with '/'
  std::vector<std::string> lines;
};

// The files below the `folders` of `root` (or named there one by one) with one of the `extensions`
// ("", ".h", ...), in the order of their paths. Throws std::runtime_error when a folder is missing.
std::vector<SourceFile> ReadSourceFiles(const std::filesystem::path& root,
                                        const std::vector<std::string>& folders,
                                        const std::vector<std::string>& extensions);

// The lines with comments and the inside of string and character literals blanked out. Knows C++
// without raw strings; a line keeps its number.
std::vector<std::string> CodeOnly(const std::vector<std::string>& lines);

}  // namespace mono3d::house
