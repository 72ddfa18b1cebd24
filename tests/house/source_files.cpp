// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "house/source_files.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace mono3d::house {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> ReadLines(const fs::path& path) {
  std::ifstream stream(path);
  if (!stream) throw std::runtime_error("cannot read " + path.string());
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Where the scan of one line stands.
enum class Inside { kCode, kBlockComment, kString, kCharacter };

// Blanks one line; `inside` is the state at its start and becomes the state at its end.
std::string CodeOfLine(const std::string& line, Inside& inside) {
  std::string code(line.size(), ' ');
  for (std::size_t i = 0; i < line.size(); ++i) {
    const std::string_view rest = std::string_view(line).substr(i);
    if (inside == Inside::kBlockComment) {
      if (rest.starts_with("*/")) inside = Inside::kCode, ++i;
    } else if (inside == Inside::kCode) {
      if (rest.starts_with("//")) break;
      if (rest.starts_with("/*")) {
        inside = Inside::kBlockComment, ++i;
        continue;
      }
      const bool digit_separator = i > 0 && std::isalnum(static_cast<unsigned char>(line[i - 1]));
      if (rest.front() == '"') inside = Inside::kString;
      if (rest.front() == '\'' && !digit_separator) inside = Inside::kCharacter;
      code[i] = rest.front();
    } else if (rest.front() == '\\') {
      ++i;
    } else if (rest.front() == (inside == Inside::kString ? '"' : '\'')) {
      inside = Inside::kCode;
      code[i] = rest.front();
    }
  }
  if (inside != Inside::kBlockComment) inside = Inside::kCode;
  return code;
}

}  // namespace

std::vector<SourceFile> ReadSourceFiles(const fs::path& root,
                                        const std::vector<std::string>& folders,
                                        const std::vector<std::string>& extensions) {
  std::vector<fs::path> paths;
  for (const std::string& folder : folders) {
    const fs::path start = root / folder;
    if (!fs::exists(start)) throw std::runtime_error("there is no " + start.string());
    if (fs::is_regular_file(start)) {
      paths.push_back(start);
      continue;
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(start)) {
      const std::string extension = entry.path().extension().string();
      const bool wanted = std::ranges::find(extensions, extension) != extensions.end();
      if (entry.is_regular_file() && wanted) paths.push_back(entry.path());
    }
  }
  std::ranges::sort(paths);
  std::vector<SourceFile> files;
  for (const fs::path& path : paths) {
    files.push_back({fs::relative(path, root).generic_string(), ReadLines(path)});
  }
  return files;
}

std::vector<std::string> CodeOnly(const std::vector<std::string>& lines) {
  std::vector<std::string> code;
  Inside inside = Inside::kCode;
  for (const std::string& line : lines) code.push_back(CodeOfLine(line, inside));
  return code;
}

}  // namespace mono3d::house
