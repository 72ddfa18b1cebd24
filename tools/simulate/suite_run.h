// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "simulate/sequence_folder.h"
#include "synthetic/suite.h"

namespace mono3d::tools {

// Those sequences whose name fits the shell pattern; all when it is empty. Throws UsageError when
// none does.
std::vector<synthetic::SuiteSequence> SelectSequences(std::vector<synthetic::SuiteSequence> suite,
                                                      const std::string& pattern);

// The paper's Table 1 beside that of these flights, as lines of text. `mean_depth_m` 0: not known.
std::string FlightTable(const synthetic::FlightSamples& samples, double mean_depth_m);

// One line for each sequence: name, images, height, speed, angular velocity, rate.
std::string PlanTable(const std::vector<synthetic::SuiteSequence>& suite);

// Statistics of those sequences of the suite that are complete in the folder: the table of
// FlightTable with the true heights above the ground, and the mean depth.
std::string FolderTable(const std::vector<synthetic::SuiteSequence>& suite,
                        const std::filesystem::path& folder);

}  // namespace mono3d::tools
