// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/atomic_file.h"

#include <cerrno>
#include <system_error>
#include <utility>

#include "core/system_error.h"

namespace mono3d {

AtomicFile::AtomicFile(std::filesystem::path path, std::string_view partial_suffix)
    : path_(std::move(path)) {
  partial_path_ = path_;
  partial_path_ += partial_suffix;
  file_ = std::fopen(partial_path_.c_str(), "wb");
  if (file_ == nullptr) ThrowSystemError("cannot create the file", path_, errno);
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

void AtomicFile::Commit() {
  // What is still in the buffer is written here: this is where a full disk shows with small files.
  const int flush_error = std::fflush(file_) == 0 ? 0 : errno;
  const int close_error = std::fclose(std::exchange(file_, nullptr)) == 0 ? 0 : errno;
  if (flush_error != 0) ThrowSystemError("cannot write the file", path_, flush_error);
  if (close_error != 0) ThrowSystemError("cannot write the file", path_, close_error);
  std::error_code error;
  std::filesystem::rename(partial_path_, path_, error);
  if (error) ThrowSystemError("cannot rename the finished file", path_, error.value());
  partial_path_.clear();
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.Write(bytes);
  file.Commit();
}

}  // namespace mono3d
