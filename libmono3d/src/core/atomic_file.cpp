// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "core/system_error.h"

namespace mono3d {

namespace {

// A new file: what lies there under its name, half written or a link to another file, goes.
int CreateNew(const std::filesystem::path& path) {
  constexpr mode_t kReadAndWrite = 0666;  // less the umask
  constexpr int kFlags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  const int descriptor = open(path.c_str(), kFlags, kReadAndWrite);
  if (descriptor >= 0 || errno != EEXIST) return descriptor;
  std::error_code ignored;
  const std::filesystem::file_type type = std::filesystem::symlink_status(path, ignored).type();
  errno = EEXIST;
  const bool may_go =
      type == std::filesystem::file_type::regular || type == std::filesystem::file_type::symlink;
  if (!may_go || unlink(path.c_str()) != 0) return -1;
  return open(path.c_str(), kFlags, kReadAndWrite);
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path, std::string_view partial_suffix)
    : path_(std::move(path)) {
  partial_path_ = path_;
  partial_path_ += partial_suffix;
  const int descriptor = CreateNew(partial_path_);
  file_ = descriptor < 0 ? nullptr : fdopen(descriptor, "wb");
  if (file_ != nullptr) return;
  const int error = errno;
  if (descriptor >= 0) {
    close(descriptor);
    unlink(partial_path_.c_str());
  }
  ThrowSystemError("cannot create the file", path_, error);
}

AtomicFile::~AtomicFile() {
  if (file_ != nullptr) std::fclose(file_);
  std::error_code ignored;
  if (!partial_path_.empty()) std::filesystem::remove(partial_path_, ignored);
}

void AtomicFile::Write(std::string_view bytes) {
  if (bytes.empty()) return;  // data() may be null then, which fwrite does not allow
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size()) return;
  ThrowSystemError("cannot write the file", path_, errno);
}

void AtomicFile::Commit(Durability durability) {
  // What is still in the buffer is written here: this is where a full disk shows with small files.
  int flush_error = std::fflush(file_) == 0 ? 0 : errno;
  // Where the file system cannot promise it (EINVAL), the file is written all the same.
  const bool is_synchronised = flush_error == 0 && durability == Durability::kOnDisk;
  if (is_synchronised && fdatasync(fileno(file_)) != 0 && errno != EINVAL) flush_error = errno;
  const int close_error = std::fclose(std::exchange(file_, nullptr)) == 0 ? 0 : errno;
  if (flush_error != 0) ThrowSystemError("cannot write the file", path_, flush_error);
  if (close_error != 0) ThrowSystemError("cannot write the file", path_, close_error);
  std::error_code error;
  std::filesystem::rename(partial_path_, path_, error);
  if (error) ThrowSystemError("cannot rename the finished file", path_, error.value());
  partial_path_.clear();
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes,
                         Durability durability) {
  AtomicFile file(path);
  file.Write(bytes);
  file.Commit(durability);
}

}  // namespace mono3d
