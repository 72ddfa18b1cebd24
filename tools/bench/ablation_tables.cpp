// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/ablation.h"

namespace mono3d::tools {
namespace {

std::vector<std::string> RowOf(const std::string& name, const AblationFigures& figures) {
  if (figures.num_maps == 0) {
    return {name, "-", "-", "-", "0.0 %", "-", "-", "-", FormatFixed(figures.cpu_ms, 0)};
  }
  return {name,
          FormatFixed(figures.l1_rel, 5),
          FormatFixed(figures.delta_101, 4),
          FormatFixed(figures.delta_105, 4),
          FormatPercent(figures.density),
          FormatFixed(figures.normals_median_deg, 2),
          FormatFixed(figures.slanted_l1_rel, 5),
          FormatPercent(figures.removed) + " / " + FormatPercent(figures.removed_oracle),
          FormatFixed(figures.cpu_ms, 0)};
}

Json ToJson(const AblationFigures& figures) {
  return {{"maps", figures.num_maps},
          {"bundles", figures.num_bundles},
          {"l1_rel", figures.l1_rel},
          {"delta_1.01", figures.delta_101},
          {"delta_1.05", figures.delta_105},
          {"density", figures.density},
          {"normals_median_deg", figures.normals_median_deg},
          {"slanted_l1_rel", figures.slanted_l1_rel},
          {"error_removed_by_worst_tenth", figures.removed},
          {"error_removed_by_worst_tenth_oracle", figures.removed_oracle},
          {"cpu_ms", figures.cpu_ms}};
}

}  // namespace

std::vector<Table> ToTables(const AblationResult& result) {
  Table means;
  means.title = "Ablation of the depth stage, on " + result.device;
  means.columns = {"",        "L1-rel",           "delta 1.01",      "delta 1.05",
                   "density", "normals, degrees", "L1-rel, slanted", "removed / oracle",
                   "CPU ms"};
  Table by_sequence;
  by_sequence.title = "L1-rel by sequence";
  by_sequence.columns = {""};
  by_sequence.columns.insert(by_sequence.columns.end(), result.sequences.begin(),
                             result.sequences.end());
  for (const AblationRow& row : result.rows) {
    means.rows.push_back(RowOf(row.name, row.mean));
    by_sequence.rows.push_back({row.name});
    for (const AblationFigures& figures : row.sequences) {
      by_sequence.rows.back().push_back(figures.num_maps > 0 ? FormatFixed(figures.l1_rel, 5)
                                                             : "-");
    }
  }
  if (!result.rows.empty()) {
    means.notes = {
        "Means over " + std::to_string(result.sequences.size()) + " sequences, " +
        FormatFixed(result.rows.front().mean.num_bundles, 0) +
        " bundles, at true poses, each map scaled by its median. Normals: the median angle. "
        "Slanted: "
        "more than " +
        FormatFixed(kSlantedFrom_deg, 0) +
        " degrees between normal and ray. Removed: the share of L1-rel that goes with the least "
        "confident tenth of the pixels, and with the worst tenth. CPU: of the process, for one "
        "map."};
  }
  return {means, by_sequence};
}

Json ToJson(const AblationResult& result) {
  Json json = {{"device", result.device}, {"sequences", result.sequences}};
  json["variants"] = Json::array();
  for (const AblationRow& row : result.rows) {
    Json variant = {{"name", row.name}, {"mean", ToJson(row.mean)}};
    for (std::size_t i = 0; i < row.sequences.size(); ++i) {
      variant["sequences"][result.sequences[i]] = ToJson(row.sequences[i]);
    }
    json["variants"].push_back(variant);
  }
  return json;
}

}  // namespace mono3d::tools
