// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Whether a file is on the disk before it has its name, so that it is whole after a power cut as
// well: some milliseconds, on slow cards many.
enum class Durability { kOnDisk, kInCache };

// A file that appears under its name only when it is complete: it is written beside, as
// "<name>.partial", and renamed. A killed run or a full disk leaves the old file as it was.
class AtomicFile {
 public:
  // `partial_suffix` must differ between processes that may write the same file at the same time.
  // Throws Error (kIo) when the file cannot be created.
  explicit AtomicFile(std::filesystem::path path, std::string_view partial_suffix = ".partial");
  // Removes what was written, unless it was committed.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Both throw Error (kIo) that names the file and what the system says ("No space left on
  // device").
  void Write(std::string_view bytes);
  void Commit(Durability durability = Durability::kOnDisk);

 private:
  std::filesystem::path path_;
  std::filesystem::path partial_path_;
  std::FILE* file_ = nullptr;
};

// All of a file at once. Throws Error as AtomicFile does.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes,
                         Durability durability = Durability::kOnDisk);

}  // namespace mono3d
