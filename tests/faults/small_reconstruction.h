// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace mono3d::faults {

using Environment = std::map<std::string, std::string>;

// How a run of the tool ended.
struct EndedRun {
  int exit_status = -1;  // -1: it did not come to its end
  int signal = 0;        // that ended it
  bool has_hung = false;
  std::string output;
  std::string errors;
};

// A reconstruction of the shipped sequence, or of a video of it, on images so small that it takes a
// second or two, into the folder `out` below the one given.
class SmallReconstruction {
 public:
  SmallReconstruction(std::filesystem::path folder, std::vector<std::string> extra,
                      const std::filesystem::path& video = {});

  std::filesystem::path output() const { return folder_ / "out"; }
  const std::filesystem::path& folder() const { return folder_; }

  // Empties the output folder, and puts into it what looks like an earlier run and a file of the
  // user's own.
  void MakeEarlierRun() const;
  // What of that has gone or changed; empty: nothing.
  std::string ChangeOfEarlierRun() const;
  // Whether nothing but the user's own file is left of it.
  bool IsEarlierRunGone() const;

  // Runs the tool to its end, with `more` arguments. `watch` is called every few milliseconds with
  // the process.
  EndedRun Run(const Environment& environment, const std::function<void(pid_t)>& watch = {},
               const std::vector<std::string>& more = {}) const;

 private:
  std::filesystem::path folder_;
  std::vector<std::string> arguments_;
};

// What the process sees beside its own environment: the files of MONO3D_FAULT are those below the
// folder and of the shipped sequence.
Environment FileFaults(const std::filesystem::path& folder, const std::string& fault);
Environment DeviceFaults(const std::string& fault);

}  // namespace mono3d::faults
