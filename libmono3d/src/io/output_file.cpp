// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>
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
  // Only an attempt tells: permissions, read-only mounts, quotas. mkstemp follows no link.
  std::string probe = folder / ".mono3d_probe_XXXXXX";
  const int file = mkstemp(probe.data());
  if (file < 0) ThrowSystemError("cannot write into the folder", folder, errno);
  close(file);
  std::filesystem::remove(probe, error);
  if (error) ThrowSystemError("cannot remove the file", probe, error.value());
}

void RequireWritableFile(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    ThrowSystemError("cannot write the file", file, EISDIR);
  }
  const AtomicFile probe(file);
}

}  // namespace mono3d
