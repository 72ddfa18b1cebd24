// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/run_folder.h"

#include <algorithm>
#include <system_error>
#include <vector>

#include "core/system_error.h"
#include "pipeline/run_files.h"

namespace mono3d {
namespace {

// All files below `folder`, by their paths below it.
std::vector<std::filesystem::path> FilesBelow(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (!it->is_directory()) files.push_back(it->path().lexically_relative(folder));
  }
  if (error) ThrowSystemError("cannot read the folder", folder, error.value());
  std::ranges::sort(files);
  return files;
}

}  // namespace

bool HoldsRun(const std::filesystem::path& folder) { return !FilesOfRun(folder).empty(); }

void ReplaceRun(const std::filesystem::path& folder, const std::filesystem::path& made) {
  const std::vector<std::filesystem::path> files = FilesBelow(made);
  // What the new run has under the same name is replaced below, in one step.
  for (const std::filesystem::path& old : FilesOfRun(folder)) {
    if (!std::ranges::binary_search(files, old)) RemoveRunFile(folder / old);
  }
  std::error_code error;
  for (const std::filesystem::path& file : files) {
    std::filesystem::create_directories((folder / file).parent_path(), error);
    std::filesystem::rename(made / file, folder / file, error);
    if (error) ThrowSystemError("cannot move a file of the run to", folder / file, error.value());
  }
  std::filesystem::remove_all(made, error);
}

}  // namespace mono3d
