// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/evaluation.h"

#include <cstdio>
#include <fstream>
#include <iterator>

#include "common/json_file.h"
#include "mono3d/core/version.h"
#include "mono3d/io/output_file.h"
#include "run_report/run_report.h"

namespace mono3d::tools {
namespace {

// One page of the run and its evaluation, or the latter alone where the run left none.
std::string ReportHtml(const Page& page, const std::string& run_report) {
  std::ifstream file(run_report, std::ios::binary);
  const std::string html{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  Page with_heading = page;
  // The page of the run tells it already.
  std::erase_if(with_heading.sections,
                [](const Section& section) { return section.title == kRecordTitle; });
  Section heading;
  heading.title = "Compared with the truth";
  heading.paragraphs = {page.subtitle};
  with_heading.sections.insert(with_heading.sections.begin(), heading);
  const std::string both = html.empty() ? "" : WithEvaluation(html, with_heading);
  return both.empty() ? ToHtml(page) : both;
}

}  // namespace

void WriteEvaluation(const Evaluation& evaluation, const EvaluationOutput& output) {
  std::fputs(ToText(evaluation.page).c_str(), stdout);
  if (!output.json.empty()) {
    // Invalid UTF-8 in a path must not cost the user the record.
    WriteFileAtomically(output.json, JsonText(evaluation.json));
  }
  if (!output.pictures.empty()) WritePictures(output.pictures, evaluation.page);
  if (!output.report.empty()) {
    WriteFileAtomically(output.report, ReportHtml(evaluation.page, output.run_report));
    std::printf("\nreport %s\n", output.report.c_str());
  }
}

Json RecordOf(const std::string& command, const std::string& estimate, const std::string& truth) {
  return {{"mono3d", Version()}, {"command", command}, {"estimate", estimate}, {"truth", truth}};
}

Json ToJson(const ErrorStatistics& statistics) {
  return {{"count", statistics.count},   {"rmse", statistics.rmse},   {"mean", statistics.mean},
          {"median", statistics.median}, {"sigma", statistics.sigma}, {"min", statistics.min},
          {"max", statistics.max}};
}

Json ToJson(const CloudError& error) {
  Json json = {{"estimate_to_truth_m", ToJson(error.estimate_to_truth)},
               {"truth_to_estimate_m", ToJson(error.truth_to_estimate)},
               {"estimate_to_truth_plane_m", ToJson(error.estimate_to_truth_plane)},
               {"truth_to_estimate_plane_m", ToJson(error.truth_to_estimate_plane)},
               {"estimate_spacing_m", error.estimate_spacing_m},
               {"truth_spacing_m", error.truth_spacing_m}};
  for (const CloudShares& shares : error.shares) {
    json["shares"].push_back({{"threshold_m", shares.threshold_m},
                              {"accuracy", shares.accuracy},
                              {"completeness", shares.completeness},
                              {"f_score", shares.f_score},
                              {"accuracy_to_plane", shares.accuracy_to_plane},
                              {"completeness_to_plane", shares.completeness_to_plane},
                              {"f_score_to_plane", shares.f_score_to_plane}});
  }
  return json;
}

Json ToJson(const Similarity& similarity) {
  const Eigen::Vector3d& translation = similarity.pose().translation();
  const Eigen::Quaterniond& rotation = similarity.pose().rotation();
  return {{"scale", similarity.scale()},
          {"rotation", {rotation.x(), rotation.y(), rotation.z(), rotation.w()}},
          {"translation", {translation.x(), translation.y(), translation.z()}}};
}

std::string FormatLength(double length_m, std::optional<double> mean_depth_m) {
  std::string text = FormatNumber(length_m);
  if (mean_depth_m) text += " (" + FormatPercent(length_m / *mean_depth_m, 3) + ")";
  return text;
}

}  // namespace mono3d::tools
