// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fuzz/input_folder.h"

#include <unistd.h>

#include <fstream>
#include <system_error>

namespace mono3d::fuzz {

InputFolder::InputFolder(const std::string& name)
    : path_(std::filesystem::temp_directory_path() /
            ("mono3d_fuzz_" + std::to_string(getpid()) + "_" + name)) {
  std::filesystem::create_directories(path_);
}

InputFolder::~InputFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path InputFolder::Write(const std::string& name, std::string_view bytes) const {
  const std::filesystem::path file = path_ / name;
  if (file.parent_path() != path_) std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return file;
}

}  // namespace mono3d::fuzz
