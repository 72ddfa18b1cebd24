// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/sequence_result.h"
#include "report/page.h"

namespace mono3d::tools {

// Mean and standard deviation over those successful sequences that have the figure.
struct SuiteMean {
  int count = 0;
  double mean = 0;
  double sigma = 0;
};
std::optional<SuiteMean> MeanOverSuccesses(std::span<const SequenceResult> results,
                                           std::optional<double> SequenceResult::*figure);
std::optional<SuiteMean> MeanOverSuccesses(std::span<const SequenceResult> results,
                                           LengthErrors SequenceResult::*errors,
                                           std::optional<double> LengthErrors::*figure);

// The tables in the paper's form, with its own figures below ours: lengths in metres at the
// paper's mean depth (83.4 m) and in percent of the depth.
std::vector<Table> SuiteTables(std::span<const SequenceResult> results);

// The overview: the tables, and for each sequence its pictures, small, with a link to its report
// in `output`.
Page SuitePage(std::span<const SequenceResult> results, const std::string& suite,
               const std::filesystem::path& output);

std::string ToMarkdown(const Page& page);
Json ToJson(std::span<const SequenceResult> results, const std::string& suite);

}  // namespace mono3d::tools
