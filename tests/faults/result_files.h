// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace mono3d::faults {

// Of a run that failed, folders may lack files; a killed one may have left files half written under
// other names.
enum class RunState { kWhole, kFailed, kKilled };

// Reads every file below `folder`. What cannot be read, is not whole or is of no known kind is in
// the text, each with its reason; empty: nothing. Files of SmallReconstruction's earlier run are
// left out.
std::string FaultsOfFiles(const std::filesystem::path& folder, RunState state);

// The names of the files below `folder`, without the folders of unfinished runs.
std::set<std::string> NamesOfFiles(const std::filesystem::path& folder);

}  // namespace mono3d::faults
