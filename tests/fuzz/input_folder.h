// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "mono3d/core/error.h"

namespace mono3d::fuzz {

// A folder of its own for the files of a target; gone when the process ends.
class InputFolder {
 public:
  explicit InputFolder(const std::string& name);
  ~InputFolder();
  InputFolder(const InputFolder&) = delete;
  InputFolder& operator=(const InputFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // Writes the file and returns its path.
  std::filesystem::path Write(const std::string& name, std::string_view bytes) const;

 private:
  std::filesystem::path path_;
};

// What `read` returns; nothing where it refuses its input.
template <typename Read>
auto ReadOrRefuse(Read&& read) -> std::optional<decltype(read())> {
  try {
    return std::forward<Read>(read)();
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace mono3d::fuzz
