// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/output_file.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "core/system_error.h"
#include "mono3d/core/error.h"

namespace mono3d {

void CreateOutputFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) ThrowSystemError("cannot create the folder", folder, error.value());
  if (!std::filesystem::is_directory(folder, error)) {
    throw Error(ErrorParts{.what = "cannot write into the folder",
                           .where = folder,
                           .expected = "a folder",
                           .found = "a file",
                           .code = ErrorCode::kIo});
  }
  // Only an attempt tells: permissions, read-only mounts, quotas.
  const std::filesystem::path probe = folder / ".mono3d_probe";
  std::FILE* file = std::fopen(probe.c_str(), "wb");
  if (file == nullptr) ThrowSystemError("cannot write into the folder", folder, errno);
  std::fclose(file);
  std::filesystem::remove(probe, error);
}

}  // namespace mono3d
