// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// How the measures of depth, confidence and normals are shown.

#include <algorithm>

#include "drawing/depth_picture.h"
#include "evaluate/depth_part.h"
#include "evaluate/sparsification_drawing.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/depth_map_files.h"

namespace mono3d::tools {
namespace {

Json ErrorJson(const DepthError& error) {
  return {{"true_pixels", error.num_true_pixels},
          {"pixels", error.num_pixels},
          {"density", error.density},
          {"mean_true_depth_m", error.mean_true_depth},
          {"rmse_m", error.rmse},
          {"l1_abs_m", error.l1_abs},
          {"l1_rel", error.l1_rel},
          {"delta_1.25", error.delta_125},
          {"delta_1.10", error.delta_110},
          {"delta_1.05", error.delta_105},
          {"delta_1.01", error.delta_101}};
}

Json ConfidenceJson(const ConfidenceCalibration& confidence) {
  return {{"pixels", confidence.num_pixels},
          {"l1_rel", confidence.mean_error},
          {"area_to_oracle", confidence.area_to_oracle},
          {"random_area_to_oracle", confidence.random_area_to_oracle},
          {"error_removed_by_worst_tenth", confidence.error_removed_by_worst_tenth},
          {"error_removed_by_worst_tenth_oracle", confidence.error_removed_by_worst_tenth_oracle},
          {"error_left", confidence.error_left},
          {"error_left_oracle", confidence.error_left_oracle}};
}

Json NormalJson(const NormalError& normals) {
  return {{"true_pixels", normals.num_true_pixels},
          {"pixels", normals.num_pixels},
          {"density", normals.density},
          {"angle_deg", ToJson(normals.angle_deg)},
          {"share_below_11.25_deg", normals.share_below_11_25_deg},
          {"share_below_22.5_deg", normals.share_below_22_5_deg},
          {"share_below_30_deg", normals.share_below_30_deg}};
}

std::vector<std::string> ErrorCells(const std::string& name, const DepthError& error) {
  std::vector<std::string> cells = {name};
  if (error.num_pixels == 0) {
    cells.insert(cells.end(), 7, "-");
  } else {
    for (const double value : {error.rmse, error.l1_abs}) cells.push_back(FormatNumber(value));
    cells.push_back(FormatFixed(error.l1_rel, 5));
    for (const double share :
         {error.delta_125, error.delta_110, error.delta_105, error.delta_101}) {
      cells.push_back(FormatFixed(share, 4));
    }
  }
  cells.push_back(FormatPercent(error.density));
  return cells;
}

std::string ScalingNote(const DepthEvaluation& evaluation) {
  std::string note;
  if (evaluation.options.scaling == "map") {
    note += "Each map is scaled by its median";
  } else if (evaluation.options.scaling == "run") {
    note += "All maps are scaled by one number, the median of their scales";
  } else {
    note += "Depths are compared as they are";
  }
  note += "; the maps' own scales spread by " + FormatPercent(evaluation.scale_spread, 2) + ".";
  if (evaluation.options.max_depth_m > 0) {
    note += " True depths beyond " + FormatNumber(evaluation.options.max_depth_m, 3) +
            " m are left out.";
  }
  return note;
}

Table DepthTable(const DepthEvaluation& evaluation, bool every_map) {
  Table table;
  table.title = every_map ? "Depth: every map" : "Depth: means over the maps";
  table.columns = {every_map ? "frame" : "maps",
                   "RMSE m",
                   "L1-abs m",
                   "L1-rel",
                   "delta 1.25",
                   "delta 1.10",
                   "delta 1.05",
                   "delta 1.01",
                   "density"};
  if (every_map) {
    for (const DepthMapEvaluation& map : evaluation.maps) {
      table.rows.push_back(ErrorCells(std::to_string(map.files.frame), map.error));
    }
  } else {
    table.rows.push_back(
        ErrorCells(std::to_string(evaluation.mean.num_maps_compared), evaluation.mean.mean));
    if (evaluation.matched) {
      table.rows.push_back(ErrorCells("matched", evaluation.matched->mean));
    }
    table.notes = {ScalingNote(evaluation),
                   "Density: share of the pixels with a true depth that have an estimate."};
    if (evaluation.matched) {
      table.notes.push_back("Matched: without what is inferred from the surface around.");
    }
  }
  return table;
}

Table ConfidenceTable(const ConfidenceCalibration& confidence) {
  Table table;
  table.title = "Confidence: does it know which depths are wrong?";
  table.columns = {"", "L1-rel removed with the worst tenth", "area above the oracle's curve"};
  table.rows = {{"confidence", FormatPercent(confidence.error_removed_by_worst_tenth),
                 FormatFixed(confidence.area_to_oracle, 4)},
                {"at best (oracle)", FormatPercent(confidence.error_removed_by_worst_tenth_oracle),
                 FormatFixed(0, 4)},
                {"at random", FormatPercent(0), FormatFixed(confidence.random_area_to_oracle, 4)}};
  return table;
}

Table NormalTable(const NormalError& normals) {
  Table table;
  table.title = "Normals: angle to the true surface";
  table.columns = {"pixels",      "median deg", "mean deg", "RMSE deg",
                   "below 11.25", "below 22.5", "below 30", "density"};
  table.rows = {{std::to_string(normals.num_pixels), FormatNumber(normals.angle_deg.median, 3),
                 FormatNumber(normals.angle_deg.mean, 3), FormatNumber(normals.angle_deg.rmse, 3),
                 FormatPercent(normals.share_below_11_25_deg),
                 FormatPercent(normals.share_below_22_5_deg),
                 FormatPercent(normals.share_below_30_deg), FormatPercent(normals.density)}};
  table.notes = {"Where the true depth is locally a plane."};
  return table;
}

// The best, the middle and the worst of the maps that have pixels, by L1-rel.
std::vector<std::pair<std::string, const DepthMapEvaluation*>> SelectMaps(
    const DepthEvaluation& evaluation) {
  std::vector<const DepthMapEvaluation*> maps;
  for (const DepthMapEvaluation& map : evaluation.maps) {
    if (map.error.num_pixels > 0) maps.push_back(&map);
  }
  std::stable_sort(maps.begin(), maps.end(),
                   [](const auto* a, const auto* b) { return a->error.l1_rel < b->error.l1_rel; });
  if (maps.empty()) return {};
  if (maps.size() == 1) return {{"only", maps[0]}};
  if (maps.size() == 2) return {{"better", maps[0]}, {"worse", maps[1]}};
  return {{"best", maps.front()}, {"middle", maps[maps.size() / 2]}, {"worst", maps.back()}};
}

void AddPictures(const std::string& which, const DepthMapEvaluation& map,
                 const DepthEvaluationOptions& options, Section& depth, Section& confidence) {
  const cv::Mat estimate = ReadDepthImage(map.files.estimate);
  const cv::Mat truth = ReadDepthImage(
      map.files.truth, options.png_scale > 0 ? std::optional(options.png_scale) : std::nullopt);
  DepthPictureOptions picture;
  picture.max_depth = options.max_depth_m;
  const std::string frame = "frame " + std::to_string(map.files.frame);
  const std::string measures = "L1-rel " + FormatFixed(map.error.l1_rel, 4) + ", delta 1.05 " +
                               FormatFixed(map.error.delta_105, 3) + ", density " +
                               FormatPercent(map.error.density);
  depth.figures.push_back(
      {"depth_" + which,
       "The " + which + " map, " + frame + ": estimate, truth, relative error. " + measures + ".",
       "Estimated depth, true depth and relative error of " + frame + " side by side; " + measures +
           ".",
       DepthPicture(estimate, truth, map.error.scale, picture)});
  if (!map.confidence) return;
  confidence.figures.push_back(
      {"confidence_" + which,
       "The " + which + " map, " + frame +
           ": where the confidence is to be believed, bright on the left is dark on the right.",
       "Confidence and relative error of " + frame +
           " side by side; the worst tenth by confidence "
           "holds " +
           FormatPercent(map.confidence->error_removed_by_worst_tenth) + " of the error.",
       ConfidencePicture(ReadConfidence(map.files.confidence), estimate, truth, map.error.scale,
                         picture)});
}

}  // namespace

Json ToJson(const DepthEvaluation& evaluation) {
  Json json;
  Json& depth = json["depth"];
  depth["scaling"] = evaluation.options.scaling;
  depth["max_depth_m"] = evaluation.options.max_depth_m;
  depth["maps"] = evaluation.mean.num_maps;
  depth["maps_compared"] = evaluation.mean.num_maps_compared;
  depth["scale_spread"] = evaluation.scale_spread;
  depth["mean"] = ErrorJson(evaluation.mean.mean);
  if (evaluation.matched) depth["matched"] = ErrorJson(evaluation.matched->mean);
  for (const DepthMapEvaluation& map : evaluation.maps) {
    Json& entry = depth["frames"].emplace_back();
    entry["frame"] = map.files.frame;
    entry["scale"] = map.error.scale;
    entry.update(ErrorJson(map.error));
  }
  if (evaluation.confidence) json["confidence"] = ConfidenceJson(*evaluation.confidence);
  if (evaluation.normals) json["normals"] = NormalJson(*evaluation.normals);
  return json;
}

std::vector<Section> DepthSections(const DepthEvaluation& evaluation, bool with_pictures) {
  Section depth;
  depth.title = "Depth";
  depth.tables = {DepthTable(evaluation, false)};
  depth.folded_tables = {DepthTable(evaluation, true)};
  Section confidence;
  confidence.title = "Confidence";
  if (evaluation.confidence) {
    confidence.tables = {ConfidenceTable(*evaluation.confidence)};
    if (with_pictures) {
      confidence.figures.push_back(SparsificationFigure(*evaluation.confidence));
    }
  }
  if (with_pictures) {
    for (const auto& [which, map] : SelectMaps(evaluation)) {
      AddPictures(which, *map, evaluation.options, depth, confidence);
    }
  }
  std::vector<Section> sections = {depth};
  if (evaluation.confidence) sections.push_back(confidence);
  if (evaluation.normals) {
    Section normals;
    normals.title = "Normals";
    normals.tables = {NormalTable(*evaluation.normals)};
    sections.push_back(normals);
  }
  return sections;
}

}  // namespace mono3d::tools
