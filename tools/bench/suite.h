// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/sequence_result.h"

namespace mono3d::tools {

struct SuiteOptions {
  std::string folder;                              // of sequence folders
  std::string output = "bench";                    // a folder for each sequence is made in it
  std::string only = "*";                          // pattern of names
  bool resume = false;                             // keep results made by the same commands
  double time_limit_s = 0;                         // for each program; 0: none
  double max_depth_m = 0;                          // of the true depths, 0: no bound
  std::vector<std::string> reconstruct_arguments;  // handed on
};

// The folders in `folder` that are sequences, having images/ or camera.yaml, by name. Throws Error
// when there are none, or none of them fits the pattern.
std::vector<std::filesystem::path> ListSequences(const SuiteOptions& options);

// Runs mono3d-reconstruct and mono3d-evaluate, which lie beside this program, on each sequence,
// each in a process of its own: one that crashes, hangs or is no sequence at all is a failure with
// a reason and the next one follows. `on_result` is called after each. Ends early when a stop is
// requested; the results so far are returned.
std::vector<SequenceResult> RunSuite(const SuiteOptions& options,
                                     const std::function<void(const SequenceResult&)>& on_result);

}  // namespace mono3d::tools
