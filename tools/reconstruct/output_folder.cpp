// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/output_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <system_error>

#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "mono3d/pipeline/run_folder.h"
#include "reconstruct/run_journal.h"

namespace mono3d::tools {
namespace {

// A lock of the folder itself: no file is left behind, and it ends with the process, however that
// ends. Where the file system has no locks, there is none.
int LockFolder(const std::filesystem::path& folder) {
  const int lock = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock < 0 || flock(lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return lock;
  close(lock);
  throw Error(ErrorParts{.what = "another run is writing into this folder: wait for its end, or "
                                 "give another --output",
                         .where = folder,
                         .expected = {},
                         .found = {},
                         .code = ErrorCode::kIo});
}

bool HasFiles(const std::filesystem::path& folder) {
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (!it->is_directory(error)) return true;
  }
  return static_cast<bool>(error);  // who knows
}

std::filesystem::path FreeName(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (int number = 1;; ++number) {
    std::filesystem::path name = folder / (kUnfinishedStem + std::to_string(number));
    const std::filesystem::file_status status = std::filesystem::symlink_status(name, ignored);
    // A run that was killed at once has left nothing in its folder.
    const bool is_empty = std::filesystem::is_directory(status) && !HasFiles(name);
    if (!std::filesystem::exists(status) || is_empty) return name;
  }
}

}  // namespace

OutputFolder::OutputFolder(const std::filesystem::path& folder, bool resumes) : folder_(folder) {
  CreateOutputFolder(folder_);
  lock_ = LockFolder(folder_);
  EndReplacements(folder_);
  const auto to_resume = resumes ? FolderToResume(folder_) : std::nullopt;
  of_run_ = to_resume ? *to_resume : HoldsRun(folder_) ? FreeName(folder_) : folder_;
}

OutputFolder::~OutputFolder() {
  (void)Keep();
  if (lock_ >= 0) close(lock_);
}

void OutputFolder::TakePlaceOfEarlier() {
  if (of_run_ == folder_) return;
  ReplaceRun(folder_, of_run_);
  of_run_ = folder_;
}

std::string OutputFolder::Keep() {
  if (of_run_ == folder_) return {};
  const std::string earlier = "the earlier result in " + folder_.string() + " stays as it was";
  if (HasFiles(of_run_)) return earlier + "; what this run has made is in " + of_run_.string();
  std::error_code ignored;
  std::filesystem::remove_all(of_run_, ignored);
  return earlier;
}

void OutputFolder::Discard() {
  if (of_run_ == folder_) return;
  std::error_code ignored;
  std::filesystem::remove_all(of_run_, ignored);
}

void KeepingOnFailure(OutputFolder& output, const std::function<void()>& body) {
  const auto with_place = [&](const std::string& what) {
    const std::string kept = output.Keep();
    return kept.empty() ? what : what + "; " + kept;
  };
  try {
    body();
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    throw Error(with_place(error.what()), error.code());
  } catch (const std::exception& error) {
    throw Error(with_place(WordsOf(error)));
  }
}

}  // namespace mono3d::tools
