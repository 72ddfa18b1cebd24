// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "bench/position_bench.h"
#include "mono3d/core/statistics.h"

namespace mono3d::tools {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

using Quantity = PlacementSummary::Quantity;

// Over the elements `parts` of all runs.
Quantity QuantityOf(const std::vector<PositionRun>& runs, const std::vector<int>& parts) {
  Quantity quantity;
  double error = 0;
  double bound = 0;
  double over_bound = 0;
  double over_bound_of_best = 0;
  double over_bound_true_path = 0;
  const auto squared = [](double value) { return value * value; };
  for (const PositionRun& run : runs) {
    if (!run.followed.is_placed()) continue;
    for (const int part : parts) {
      ++quantity.num;
      error += squared(run.followed.error[part]);
      bound += squared(run.bound[part]);
      over_bound += squared(run.followed.error[part] / run.bound[part]);
      over_bound_of_best += squared(run.error_of_best[part] / run.bound[part]);
      over_bound_true_path += squared(run.true_path.error[part] / run.bound[part]);
      if (std::abs(run.followed.error[part]) < run.followed.sigma[part]) {
        ++quantity.num_within_sigma;
      }
    }
  }
  const double num = std::max(1, quantity.num);
  quantity.rms_error = std::sqrt(error / num);
  quantity.rms_bound = std::sqrt(bound / num);
  quantity.over_bound = std::sqrt(over_bound / num);
  quantity.over_bound_of_best = std::sqrt(over_bound_of_best / num);
  quantity.over_bound_true_path = std::sqrt(over_bound_true_path / num);
  return quantity;
}

void AddShapes(const std::vector<PositionRun>& runs, PlacementSummary& summary) {
  double local = 0;
  double local_alone = 0;
  std::vector<double> shares;
  std::vector<double> shares_alone;
  for (const PositionRun& run : runs) {
    if (!run.followed.is_placed() || !run.rigid.is_placed()) continue;
    const PlacedPathError& with = run.followed.path;
    const PlacedPathError& alone = run.rigid.path;
    local += with.local_m * with.local_m;
    local_alone += alone.local_m * alone.local_m;
    if (with.local_m > alone.local_m) ++summary.num_local_worse;
    shares.push_back(with.largest_m / with.length_m);
    shares_alone.push_back(alone.largest_m / alone.length_m);
  }
  if (shares.empty()) return;
  const auto num = static_cast<double>(shares.size());
  summary.local_m = std::sqrt(local / num);
  summary.local_alone_m = std::sqrt(local_alone / num);
  summary.worst_share = std::ranges::max(shares);
  summary.largest_share = Median(std::move(shares));
  summary.largest_alone_share = Median(std::move(shares_alone));
}

std::string OverBound(double ratio) { return FormatFixed(ratio, 2); }

// "0.012 % (1.03)"
std::string ErrorAndRatio(const Quantity& quantity, double unit, const std::string& name) {
  return FormatNumber(quantity.rms_error / unit, 3) + name + " (" + OverBound(quantity.over_bound) +
         ")";
}

std::string Within(const Quantity& quantity) {
  return quantity.num == 0
             ? "-"
             : FormatPercent(static_cast<double>(quantity.num_within_sigma) / quantity.num, 0);
}

// "0.98, 1.02": of the best estimate and of the true path.
std::string OverBounds(const Quantity& quantity) {
  return OverBound(quantity.over_bound_of_best) + ", " + OverBound(quantity.over_bound_true_path);
}

using Groups = std::map<std::string, std::vector<PositionRun>>;

// By the kind of flight where there are several, and all.
Groups GroupsOf(const std::vector<PositionRun>& runs) {
  Groups groups;
  for (const PositionRun& run : runs) groups[run.flight].push_back(run);
  if (groups.size() > 1) groups["~all"] = runs;
  return groups;
}

std::string NameOfGroup(const std::string& group) {
  if (group == "~all") return "all";
  return group.empty() ? "flights" : group;
}

Table PlaceTable(const std::string& receiver, const Groups& groups) {
  Table table;
  table.title = "Placed by positions of " + receiver;
  table.columns = {
      "flights", "runs",  "scale", "heading", "place", "height", "best and true path: scale",
      "heading", "place", "height"};
  for (const auto& [name, runs] : groups) {
    const PlacementSummary summary = Summarise(runs);
    table.rows.push_back(
        {NameOfGroup(name),
         std::to_string(summary.num_placed) + " of " + std::to_string(summary.num_runs),
         ErrorAndRatio(summary.scale, 0.01, " %"), ErrorAndRatio(summary.heading, kDegree, " deg"),
         ErrorAndRatio(summary.place, 1, " m"), ErrorAndRatio(summary.height, 1, " m"),
         OverBounds(summary.scale), OverBounds(summary.heading), OverBounds(summary.place),
         OverBounds(summary.height)});
  }
  table.notes = {
      "Root mean square errors, and in brackets over what the errors of the positions allow (each "
      "run over its own bound); the same ratio of the best estimate that there is (errors and "
      "outliers known, path exact) and of the exact path placed by the same positions."};
  return table;
}

Table SurenessTable(const std::string& receiver, const Groups& groups) {
  Table table;
  table.title = "How sure, by positions of " + receiver;
  table.columns = {"flights",
                   "scale within its sigma",
                   "heading",
                   "place",
                   "height",
                   "clock, median",
                   "within 50 ms",
                   "over its bound",
                   "best and true path"};
  for (const auto& [name, runs] : groups) {
    const PlacementSummary summary = Summarise(runs);
    table.rows.push_back({NameOfGroup(name), Within(summary.scale), Within(summary.heading),
                          Within(summary.place), Within(summary.height),
                          FormatNumber(1000 * summary.median_clock_s, 3) + " ms",
                          FormatPercent(summary.share_within_50_ms, 0),
                          OverBound(summary.clock.over_bound), OverBounds(summary.clock)});
  }
  table.notes = {"How often the truth is within one stated standard deviation: 68 % is right."};
  return table;
}

Table ShapeTable(const std::string& receiver, const Groups& groups) {
  Table table;
  table.title = "The shape of the path, by positions of " + receiver;
  table.columns = {"flights",      "local, images alone, m", "with positions",
                   "worse in",     "drift, images alone",    "with positions",
                   "the worst one"};
  for (const auto& [name, runs] : groups) {
    const PlacementSummary summary = Summarise(runs);
    table.rows.push_back(
        {NameOfGroup(name), FormatFixed(summary.local_alone_m, 4), FormatFixed(summary.local_m, 4),
         std::to_string(summary.num_local_worse) + " of " + std::to_string(summary.num_placed),
         FormatPercent(summary.largest_alone_share, 3), FormatPercent(summary.largest_share, 3),
         FormatPercent(summary.worst_share, 3)});
  }
  table.notes = {
      "Local: root mean square after the best similarity of each stretch. Drift: largest distance "
      "after the best similarity of the whole path, as a share of its length (median)."};
  return table;
}

std::optional<Table> PlacedModelTable(const std::vector<PositionRun>& runs) {
  Table table;
  table.title = "Models as they lie, without ground control";
  table.columns = {"flight", "positions", "GSD, m", "median distance",
                   "in GSD", "aligned",   "RMSE",   "camera, RMS"};
  for (const PositionRun& run : runs) {
    if (!run.model) continue;
    const PlacedModel& model = *run.model;
    if (!model.reason.empty()) {
      table.rows.push_back({run.sequence, run.receiver, "-", model.reason, "-", "-", "-", "-"});
      continue;
    }
    table.rows.push_back({run.sequence, run.receiver, FormatFixed(model.ground_sample_m, 3),
                          FormatFixed(model.median_m, 3) + " m",
                          FormatFixed(model.median_m / model.ground_sample_m, 2),
                          FormatFixed(model.median_aligned_m, 3) + " m",
                          FormatFixed(model.rmse_m, 3) + " m",
                          FormatFixed(run.followed.path.rms_m, 3) + " m"});
  }
  if (table.rows.empty()) return std::nullopt;
  table.notes = {
      "Distances of the model's surfels to the true surface, in the coordinates that the run "
      "wrote; aligned: once registered to it with scale."};
  return table;
}

Json PlacementJson(const PlacementVector& vector) {
  return {{"east_m", vector[0]},    {"north_m", vector[1]},
          {"up_m", vector[2]},      {"heading_deg", vector[5] / kDegree},
          {"log_scale", vector[6]}, {"clock_offset_s", vector[7]}};
}

Json PlacementJson(const PlacedRun& run) {
  if (!run.is_placed()) return {{"reason", run.reason}};
  return {{"error", PlacementJson(run.error)},
          {"sigma", PlacementJson(run.sigma)},
          {"rms_m", run.path.rms_m},
          {"largest_share", run.path.largest_m / run.path.length_m},
          {"local_m", run.path.local_m}};
}

}  // namespace

PlacementSummary Summarise(const std::vector<PositionRun>& runs) {
  PlacementSummary summary;
  summary.num_runs = static_cast<int>(runs.size());
  std::vector<double> clock_errors_s;
  for (const PositionRun& run : runs) {
    if (!run.followed.is_placed()) continue;
    ++summary.num_placed;
    clock_errors_s.push_back(std::abs(run.followed.error[7]));
  }
  if (summary.num_placed == 0) return summary;
  summary.place = QuantityOf(runs, {0, 1});
  summary.height = QuantityOf(runs, {2});
  summary.heading = QuantityOf(runs, {5});
  summary.scale = QuantityOf(runs, {6});
  summary.clock = QuantityOf(runs, {7});
  const auto num_close = std::ranges::count_if(clock_errors_s, [](double error_s) {
    constexpr double kClose_s = 0.05;
    return error_s <= kClose_s;
  });
  summary.share_within_50_ms = static_cast<double>(num_close) / summary.num_placed;
  summary.median_clock_s = Median(std::move(clock_errors_s));
  AddShapes(runs, summary);
  return summary;
}

std::vector<Table> ToTables(const std::vector<PositionRun>& runs) {
  std::vector<std::string> receivers;
  for (const PositionRun& run : runs) {
    if (std::ranges::find(receivers, run.receiver) == receivers.end()) {
      receivers.push_back(run.receiver);
    }
  }
  std::vector<Table> tables;
  for (const std::string& receiver : receivers) {
    std::vector<PositionRun> of_receiver;
    std::ranges::copy_if(runs, std::back_inserter(of_receiver),
                         [&](const PositionRun& run) { return run.receiver == receiver; });
    const Groups groups = GroupsOf(of_receiver);
    tables.push_back(PlaceTable(receiver, groups));
    tables.push_back(SurenessTable(receiver, groups));
    tables.push_back(ShapeTable(receiver, groups));
  }
  if (std::optional<Table> models = PlacedModelTable(runs)) tables.push_back(*std::move(models));
  return tables;
}

Json ToJson(const std::vector<PositionRun>& runs) {
  Json list = Json::array();
  for (const PositionRun& run : runs) {
    Json json = {{"sequence", run.sequence},
                 {"flight", run.flight},
                 {"positions", run.receiver},
                 {"seed", run.seed},
                 {"share_tracked", run.share_tracked},
                 {"bound", PlacementJson(run.bound)},
                 {"error_of_best", PlacementJson(run.error_of_best)},
                 {"followed", PlacementJson(run.followed)},
                 {"images_alone", PlacementJson(run.rigid)},
                 {"true_path", PlacementJson(run.true_path)}};
    if (run.model && run.model->reason.empty()) {
      json["model"] = {{"ground_sample_m", run.model->ground_sample_m},
                       {"median_m", run.model->median_m},
                       {"rmse_m", run.model->rmse_m},
                       {"median_aligned_m", run.model->median_aligned_m}};
    }
    list.push_back(std::move(json));
  }
  return {{"runs", std::move(list)}};
}

}  // namespace mono3d::tools
