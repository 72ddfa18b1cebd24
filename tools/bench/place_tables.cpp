// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>

#include "bench/place_bench.h"

namespace mono3d::tools {
namespace {

bool IsRevisit(const PlaceCounts& counts) {
  return counts.name.empty() && static_cast<int>(counts.place_class) < kNumRevisitClasses;
}

std::string NameOfCounts(const PlaceCounts& counts) {
  return counts.name.empty() ? ToString(counts.place_class) : counts.name;
}

std::optional<double> Rmse(const PlaceCounts& counts) {
  if (counts.num_right == 0) return std::nullopt;
  return std::sqrt(counts.sum_squared_error / counts.num_right);
}

Table TableOf(const std::string& title, const std::vector<PlaceCounts>& counts) {
  Table table;
  table.title = title;
  table.columns = {"what they show", "asked", "place proposed", "found", "wrong", "RMSE, % depth"};
  for (const PlaceCounts& row : counts) {
    if (row.num_asked == 0) continue;
    const std::optional<double> rmse = Rmse(row);
    table.rows.push_back({NameOfCounts(row), std::to_string(row.num_asked),
                          IsRevisit(row) ? std::to_string(row.num_proposed) : "-",
                          std::to_string(row.num_right), std::to_string(row.num_wrong),
                          rmse ? FormatFixed(100 * *rmse, 3) : "-"});
  }
  const std::optional<double> recall = Recall(counts);
  table.notes = {"Recall of revisits: " + (recall ? FormatPercent(*recall) : "-") +
                 "; wrong poses: " + std::to_string(NumWrong(counts)) + "."};
  return table;
}

Json JsonOf(const std::vector<PlaceCounts>& counts) {
  Json json = Json::object();
  if (const auto recall = Recall(counts)) json["recall"] = *recall;
  json["wrong"] = NumWrong(counts);
  json["classes"] = Json::array();
  for (const PlaceCounts& row : counts) {
    Json of = {{"shows", NameOfCounts(row)}, {"is_revisit", IsRevisit(row)},
               {"asked", row.num_asked},     {"proposed", row.num_proposed},
               {"found", row.num_right},     {"wrong", row.num_wrong}};
    if (const auto rmse = Rmse(row)) of["position_rmse_share_of_depth"] = *rmse;
    json["classes"].push_back(of);
  }
  return json;
}

}  // namespace

const char* ToString(PlaceClass place_class) {
  switch (place_class) {
    case PlaceClass::kWithin10:
      return "half of it, within 10 deg";
    case PlaceClass::kWithin20:
      return "half of it, 10 to 20 deg";
    case PlaceClass::kWithin30:
      return "half of it, 20 to 30 deg";
    case PlaceClass::kLess:
      return "less of it";
    case PlaceClass::kElsewhere:
      return "none of it";
  }
  return "";
}

std::optional<double> Recall(const std::vector<PlaceCounts>& counts) {
  int num_asked = 0;
  int num_right = 0;
  for (const PlaceCounts& row : counts) {
    if (!IsRevisit(row)) continue;
    num_asked += row.num_asked;
    num_right += row.num_right;
  }
  if (num_asked == 0) return std::nullopt;
  return static_cast<double>(num_right) / num_asked;
}

int NumWrong(const std::vector<PlaceCounts>& counts) {
  int num_wrong = 0;
  for (const PlaceCounts& row : counts) num_wrong += row.num_wrong;
  return num_wrong;
}

std::vector<Table> ToTables(const PlaceBenchResult& result) {
  const std::string of = "Places of " + result.name + " up to image " +
                         std::to_string(result.split - 1) + " (" +
                         std::to_string(result.num_keyframes) + " keyframes, RMSE " +
                         FormatNumber(result.map_rmse_m, 3) + " m), asked by ";
  std::vector<Table> tables = {TableOf(of + "images, as a lost camera asks", result.images),
                               TableOf(of + "keyframes of a second map", result.keyframes)};
  tables.back().notes.emplace_back(
      "A revisit shows surface half of which a keyframe of the map shows too, from directions that "
      "differ by so much at most. A pose is right within 2 % of the mean depth, 2 degrees and "
      "2 % of the scale.");
  return tables;
}

Json ToJson(const PlaceBenchResult& result) {
  return {{"sequence", result.name},
          {"split", result.split},
          {"keyframes", result.num_keyframes},
          {"map_rmse_m", result.map_rmse_m},
          {"asked_by_images", JsonOf(result.images)},
          {"asked_by_keyframes", JsonOf(result.keyframes)}};
}

}  // namespace mono3d::tools
