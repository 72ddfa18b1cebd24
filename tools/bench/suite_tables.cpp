// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <functional>

#include "bench/paper_figures.h"
#include "bench/suite_page.h"

namespace mono3d::tools {
namespace {

std::optional<SuiteMean> MeanOf(
    std::span<const SequenceResult> results,
    const std::function<std::optional<double>(const SequenceResult&)>& figure) {
  SuiteMean mean;
  double squares = 0;
  for (const SequenceResult& result : results) {
    const std::optional<double> value = figure(result);
    if (!result.is_success || !value) continue;
    ++mean.count;
    mean.mean += *value;
    squares += *value * *value;
  }
  if (mean.count == 0) return std::nullopt;
  mean.mean /= mean.count;
  mean.sigma = std::sqrt(std::max(0.0, squares / mean.count - mean.mean * mean.mean));
  return mean;
}

// "0.134 (0.161 %)": metres at the paper's mean depth and percent of the depth.
std::string Length(std::optional<double> share) {
  if (!share) return "-";
  return FormatNumber(*share * kPaperSynthetic.mean_depth_m, 3) + " (" + FormatPercent(*share, 3) +
         ")";
}

// The paper's: its own metres, and percent of its own mean depth.
std::string PaperLength(double length_m, const PaperFigures& paper) {
  return FormatNumber(length_m, 3) + " (" + FormatPercent(length_m / paper.mean_depth_m, 3) + ")";
}

std::string Fixed(std::optional<double> value, int decimals) {
  return value ? FormatFixed(*value, decimals) : "-";
}
std::string Percent(std::optional<double> share) { return share ? FormatPercent(*share, 2) : "-"; }
std::string Rounded(std::optional<double> value) { return value ? FormatNumber(*value, 3) : "-"; }

using Row = std::vector<std::string>;
using Figure = std::optional<double> SequenceResult::*;

// Cells of one line: of a sequence, or of the mean over all, which is a sequence made of means.
using Cells = std::function<Row(const SequenceResult&)>;

SequenceResult MeanResult(std::span<const SequenceResult> results) {
  SequenceResult mean;
  int num_successes = 0;
  for (const SequenceResult& result : results) {
    if (!result.is_success) continue;
    ++num_successes;
    mean.num_frames += result.num_frames;
    mean.tracked_share += result.tracked_share;
  }
  mean.name = "mean of " + std::to_string(num_successes);
  if (num_successes > 0) mean.tracked_share /= num_successes;
  for (const Figure figure :
       {&SequenceResult::depth_rmse, &SequenceResult::depth_l1_rel, &SequenceResult::delta_125,
        &SequenceResult::delta_105, &SequenceResult::density, &SequenceResult::completeness,
        &SequenceResult::surface_rmse, &SequenceResult::seen_completeness,
        &SequenceResult::seen_f_score, &SequenceResult::frames_per_s,
        &SequenceResult::cpu_ms_per_frame, &SequenceResult::ms_per_depth_map,
        &SequenceResult::share_of_frames_used}) {
    if (const auto value = MeanOverSuccesses(results, figure)) mean.*figure = value->mean;
  }
  for (const auto errors : {&SequenceResult::model_trajectory, &SequenceResult::final_trajectory,
                            &SequenceResult::model}) {
    for (const auto figure : {&LengthErrors::rmse, &LengthErrors::mean, &LengthErrors::sigma}) {
      const auto value = MeanOverSuccesses(results, errors, figure);
      if (value) (mean.*errors).*figure = value->mean;
    }
  }
  return mean;
}

Table MakeTable(const std::string& title, const Row& columns,
                std::span<const SequenceResult> results, const Cells& cells) {
  Table table;
  table.title = title;
  table.columns = columns;
  const auto add = [&](const SequenceResult& result) {
    Row row = {result.name};
    const Row rest = cells(result);
    row.insert(row.end(), rest.begin(), rest.end());
    table.rows.push_back(row);
  };
  for (const SequenceResult& result : results) {
    if (result.is_success) add(result);
  }
  add(MeanResult(results));
  return table;
}

Table TrajectoryTable(std::span<const SequenceResult> results) {
  Table table =
      MakeTable("Trajectory (the paper's Table 2)",
                {"sequence", "tracked", "after registration: RMSE", "MAE", "sigma",
                 "every frame: RMSE", "MAE", "sigma"},
                results, [](const SequenceResult& r) {
                  return Row{FormatPercent(r.tracked_share),  Length(r.model_trajectory.rmse),
                             Length(r.model_trajectory.mean), Length(r.model_trajectory.sigma),
                             Length(r.final_trajectory.rmse), Length(r.final_trajectory.mean),
                             Length(r.final_trajectory.sigma)};
                });
  for (const PaperFigures& paper : {kPaperSynthetic, kPaperReal}) {
    table.rows.push_back({paper.name, "-", PaperLength(paper.trajectory_rmse_m, paper),
                          PaperLength(paper.trajectory_mae_m, paper),
                          PaperLength(paper.trajectory_sigma_m, paper), "-", "-", "-"});
  }
  table.notes = {"Metres at a mean depth of " + FormatNumber(kPaperSynthetic.mean_depth_m, 3) +
                 " m, the paper's (and percent of the mean depth). The paper's real sequences: "
                 "their own metres, percent of their " +
                 FormatNumber(kPaperReal.mean_depth_m, 3) + " m."};
  return table;
}

Table DepthTable(std::span<const SequenceResult> results) {
  Table table =
      MakeTable("Depth (the paper's Table 3)",
                {"sequence", "RMSE", "MAE (L1-rel)", "delta 1.25", "delta 1.05", "density"},
                results, [](const SequenceResult& r) {
                  return Row{Length(r.depth_rmse), Fixed(r.depth_l1_rel, 4), Fixed(r.delta_125, 4),
                             Fixed(r.delta_105, 4), Percent(r.density)};
                });
  for (const PaperFigures& paper : {kPaperSynthetic, kPaperReal}) {
    table.rows.push_back({paper.name, PaperLength(paper.depth_rmse_m, paper),
                          FormatFixed(paper.depth_mae, 3), FormatFixed(paper.delta_125, 3),
                          FormatFixed(paper.delta_105, 3), "-"});
  }
  return table;
}

Table ModelTable(std::span<const SequenceResult> results) {
  Table table = MakeTable("Model (the paper's Table 4)",
                          {"sequence", "RMSE", "sigma of RMSE", "completeness at 1 %",
                           "RMSE, whole surface", "completeness, seen by 5", "F-score, seen by 5"},
                          results, [](const SequenceResult& r) {
                            return Row{Length(r.model.rmse),         "-",
                                       Percent(r.completeness),      Length(r.surface_rmse),
                                       Percent(r.seen_completeness), Percent(r.seen_f_score)};
                          });
  const auto mean = MeanOverSuccesses(results, &SequenceResult::model, &LengthErrors::rmse);
  if (mean) table.rows.back()[2] = Length(mean->sigma);
  for (const PaperFigures& paper : {kPaperSynthetic, kPaperReal}) {
    table.rows.push_back({paper.name, PaperLength(paper.model_rmse_m, paper),
                          PaperLength(paper.model_sigma_rmse_m, paper), "-", "-", "-", "-"});
  }
  table.notes = {
      "RMSE: distance of each point of the model to the nearest of the truth. Sigma: "
      "over the sequences. Whole surface: the true cloud with what it lacks of the true depth "
      "maps. "
      "Seen by 5: of the surface that at least 5 frames see, within 1 % of the depth."};
  return table;
}

Table SpeedTable(std::span<const SequenceResult> results) {
  Table table = MakeTable("Speed",
                          {"sequence", "frames", "frames per s", "processor ms per frame",
                           "ms per depth map", "frames used for depth"},
                          results, [](const SequenceResult& r) {
                            return Row{FormatFixed(r.num_frames, 0), Rounded(r.frames_per_s),
                                       Rounded(r.cpu_ms_per_frame), Rounded(r.ms_per_depth_map),
                                       Percent(r.share_of_frames_used)};
                          });
  table.rows.push_back({"paper (GTX 1080 Ti)", "-", "keeps up with 30", "-",
                        FormatNumber(kPaperMsPerDepthMap, 3),
                        FormatPercent(kPaperShareOfFramesUsed, 2)});
  table.notes = {
      "Whole runs by the wall clock, with reading and writing of files and every "
      "bundle processed; processor: all threads. In the line of the mean, frames are "
      "the sum."};
  return table;
}

Table SuccessTable(std::span<const SequenceResult> results) {
  int num_successes = 0;
  Table table;
  table.title = "Successes";
  table.columns = {"", "successes", "of", "rate"};
  for (const SequenceResult& result : results) num_successes += result.is_success ? 1 : 0;
  const auto rate = [](int successes, std::size_t all) {
    return Row{std::to_string(successes), std::to_string(all),
               all > 0 ? FormatPercent(successes / static_cast<double>(all), 2) : "-"};
  };
  const auto add = [&](const std::string& name, const Row& cells) {
    Row row = {name};
    row.insert(row.end(), cells.begin(), cells.end());
    table.rows.push_back(row);
  };
  add("mono3d", rate(num_successes, results.size()));
  add("paper, synthetic", rate(kPaperNumSuccesses, kPaperNumSequences));
  table.notes = {SuccessRule()};
  for (const SequenceResult& result : results) {
    if (!result.is_success) table.notes.push_back("Failed: " + result.name + ": " + result.reason);
  }
  return table;
}

}  // namespace

std::optional<SuiteMean> MeanOverSuccesses(std::span<const SequenceResult> results,
                                           std::optional<double> SequenceResult::*figure) {
  return MeanOf(results, [figure](const SequenceResult& result) { return result.*figure; });
}

std::optional<SuiteMean> MeanOverSuccesses(std::span<const SequenceResult> results,
                                           LengthErrors SequenceResult::*errors,
                                           std::optional<double> LengthErrors::*figure) {
  return MeanOf(results,
                [errors, figure](const SequenceResult& result) { return result.*errors.*figure; });
}

std::vector<Table> SuiteTables(std::span<const SequenceResult> results) {
  return {SuccessTable(results), TrajectoryTable(results), DepthTable(results), ModelTable(results),
          SpeedTable(results)};
}

}  // namespace mono3d::tools
