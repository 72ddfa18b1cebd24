// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/file_access.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <system_error>

#include "core/system_error.h"

namespace mono3d {
namespace {

// A descriptor that is closed with its scope.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : number_(open(path.c_str(), flags | O_CLOEXEC)) {
    if (number_ < 0) ThrowSystemError("cannot open the file", path, errno);
  }
  ~Descriptor() { close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace

void CreateFolder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) ThrowSystemError("cannot create the folder", path, error.value());
}

void SynchroniseFolder(const std::filesystem::path& folder) {
  const Descriptor descriptor(folder, O_RDONLY | O_DIRECTORY);
  if (fsync(descriptor.number()) != 0 && errno != EINVAL) {
    ThrowSystemError("cannot write the folder", folder, errno);
  }
}

std::string ReadFileRange(const std::filesystem::path& path, std::uint64_t offset,
                          std::uint64_t size) {
  const Descriptor descriptor(path, O_RDONLY);
  std::string bytes(size, '\0');
  std::size_t num_read = 0;
  while (num_read < bytes.size()) {
    const ssize_t got = pread(descriptor.number(), bytes.data() + num_read, bytes.size() - num_read,
                              static_cast<off_t>(offset + num_read));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) ThrowSystemError("cannot read the file", path, errno);
    if (got == 0) break;  // cut off since it was opened: its checksum tells
    num_read += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace mono3d
