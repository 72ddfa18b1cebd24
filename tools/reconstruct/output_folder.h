// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace mono3d::tools {

// The folder of a run, locked against other runs. Where an earlier run lies in it, the new one is
// written beside, to unfinished_1 (or _2, ...) in it, and takes its place when it is whole. Until
// then, and where that never comes, both are there.
class OutputFolder {
 public:
  // Creates the folder where needed. With `resumes` the run is the one there whose journal is the
  // newest, if there is any (FolderToResume). Throws Error (kIo) where it cannot be written, or
  // another run is writing into it.
  explicit OutputFolder(const std::filesystem::path& folder, bool resumes = false);
  // As Keep, without a word.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // Where this run is written.
  const std::filesystem::path& of_run() const { return of_run_; }
  // Where it lies in the end.
  const std::filesystem::path& folder() const { return folder_; }

  // The run is whole. Throws Error (kIo) where the system refuses to move it.
  void TakePlaceOfEarlier();

  // The run is not whole: says where it is and that the earlier one stays; empty where there was no
  // earlier one. A run of no files is removed.
  std::string Keep();

  // Removes the run, where an earlier one lies in the folder.
  void Discard();

 private:
  std::filesystem::path folder_;
  std::filesystem::path of_run_;  // folder_, or below it
  int lock_ = -1;                 // file descriptor of folder_
};

// Runs `body`. What it throws comes out with what Keep says behind.
void KeepingOnFailure(OutputFolder& output, const std::function<void()>& body);

}  // namespace mono3d::tools
