// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/run_folder.h"

#include <algorithm>
#include <exception>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/system_error.h"
#include "mono3d/core/log.h"
#include "pipeline/run_files.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

// In the folder of the new run: the files of the earlier one, while they are moved there.
constexpr const char* kLeaving = ".replaced_part";
// The same, once all of them are there: the new run is being moved to their place.
constexpr const char* kLeft = ".replaced";

// All files below `folder`, by their paths below it.
std::vector<fs::path> FilesBelow(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    const fs::path below = it->path().lexically_relative(folder);
    if (it->is_directory(error)) {
      if (below == kLeaving || below == kLeft) it.disable_recursion_pending();
    } else {
      files.push_back(below);
    }
  }
  if (error) ThrowSystemError("cannot read the folder", folder, error.value());
  std::ranges::sort(files);
  return files;
}

// Renames that are undone together, unless they are kept.
class Moves {
 public:
  Moves() = default;
  ~Moves() {
    std::error_code ignored;
    for (auto it = done_.rbegin(); it != done_.rend(); ++it)
      fs::rename(it->second, it->first, ignored);
  }
  Moves(const Moves&) = delete;
  Moves& operator=(const Moves&) = delete;

  void Move(const fs::path& from, const fs::path& to) {
    std::error_code error;
    fs::create_directories(to.parent_path(), error);
    if (!error) fs::rename(from, to, error);
    if (error) ThrowSystemError("cannot move a file of the run to", to, error.value());
    done_.emplace_back(from, to);
  }
  void Move(const std::vector<fs::path>& files, const fs::path& from, const fs::path& to) {
    for (const fs::path& file : files) Move(from / file, to / file);
  }
  void Keep() { done_.clear(); }

 private:
  std::vector<std::pair<fs::path, fs::path>> done_;
};

// Whether that is the name of the folder of an unfinished run.
bool IsUnfinished(const fs::path& folder) {
  return folder.filename().string().starts_with(kUnfinishedStem);
}

void RemoveReplaced(const fs::path& made) {
  std::error_code error;
  fs::remove_all(made / kLeft, error);
  if (!error) fs::remove_all(made, error);
  if (!error) return;
  Log(LogLevel::kWarning,
      made.string() + ": cannot remove what is left of the earlier run: " + error.message());
}

// Ends what ReplaceRun began and could not end: forward where the earlier run has left, else back.
void EndReplacing(const fs::path& folder, const fs::path& made) {
  std::error_code ignored;
  Moves moves;
  if (fs::is_directory(made / kLeft, ignored)) {
    moves.Move(FilesBelow(made), made, folder);
    moves.Keep();
    RemoveReplaced(made);
  } else if (fs::is_directory(made / kLeaving, ignored)) {
    moves.Move(FilesBelow(made / kLeaving), made / kLeaving, folder);
    moves.Keep();
    fs::remove_all(made / kLeaving, ignored);
  }
}

}  // namespace

bool HoldsRun(const fs::path& folder) { return !FilesOfRun(folder).empty(); }

void ReplaceRun(const fs::path& folder, const fs::path& made) {
  const std::vector<fs::path> files = FilesBelow(made);
  Moves moves;
  moves.Move(FilesOfRun(folder), folder, made / kLeaving);
  std::error_code ignored;
  fs::create_directories(made / kLeaving, ignored);
  moves.Move(made / kLeaving, made / kLeft);
  moves.Move(files, made, folder);
  moves.Keep();
  RemoveReplaced(made);
}

void EndReplacements(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> unfinished;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (IsUnfinished(it->path()) && it->is_directory(error)) unfinished.push_back(it->path());
  }
  for (const fs::path& made : unfinished) EndReplacing(folder, made);
}

}  // namespace mono3d
