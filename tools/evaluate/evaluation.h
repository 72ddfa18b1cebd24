// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "mono3d/evaluation/cloud_error.h"
#include "mono3d/evaluation/error_statistics.h"
#include "mono3d/geometry/similarity.h"
#include "report/page.h"

namespace mono3d::tools {

using Json = nlohmann::ordered_json;

// Of the section that tells what run.json does; the page of a run has the same already.
inline constexpr const char* kRecordTitle = "The run";

// What one call of mono3d-evaluate found: to read, and to compute with.
struct Evaluation {
  Page page;
  Json json;
};

// Where it goes; empty: nowhere.
struct EvaluationOutput {
  std::string json;      // file
  std::string pictures;  // folder
  std::string report;    // file, HTML
  // The report of the run: where it is there, the figures go onto that page.
  std::string run_report = {};
  bool has_pictures() const { return !pictures.empty() || !report.empty(); }
};

// Prints the tables on stdout and writes the files. Throws Error when one cannot be written.
void WriteEvaluation(const Evaluation& evaluation, const EvaluationOutput& output);

// The beginning of every record: the version and what was compared.
Json RecordOf(const std::string& command, const std::string& estimate, const std::string& truth);

Json ToJson(const ErrorStatistics& statistics);
Json ToJson(const CloudError& error);
// Scale, rotation as quaternion (x, y, z, w) and translation.
Json ToJson(const Similarity& similarity);

// "0.0246 (0.111 %)": a length, and its share of the mean depth where that is known.
std::string FormatLength(double length_m, std::optional<double> mean_depth_m);

}  // namespace mono3d::tools
