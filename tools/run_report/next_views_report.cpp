// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/next_views_report.h"

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "mono3d/core/atomic_file.h"
#include "run_report/model_drawing.h"

namespace mono3d::tools {
namespace {

nlohmann::json Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json AreasByNeed(const std::map<ViewNeed, double>& areas_su2) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [need, area_su2] : areas_su2) json[ToString(need)] = area_su2;
  return json;
}

nlohmann::json ToJson(const NextView& view) {
  const Eigen::Quaterniond& q = view.T_world_cam.rotation();
  return {{"position", Numbers(view.T_world_cam.translation())},
          {"direction", Numbers(q * Eigen::Vector3d::UnitZ())},
          {"target", Numbers(view.target_world)},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"reason", ToString(view.MainNeed())},
          {"explanation", Explanation(view.MainNeed())},
          {"gain_su2", view.Gain()},
          {"gains_su2", AreasByNeed(view.gain_su2)}};
}

}  // namespace

void WriteNextViews(const std::filesystem::path& folder, const NextViews& next) {
  nlohmann::json views = nlohmann::json::array();
  for (const NextView& view : next.views) views.push_back(ToJson(view));
  const nlohmann::json json = {{"distance_su", next.distance_su},
                               {"cell_su", next.cell_su},
                               {"surface_su2", next.surface_su2},
                               {"to_see_again_su2", AreasByNeed(next.area_su2)},
                               {"views", std::move(views)}};
  WriteFileAtomically(folder / "next_views.json", json.dump(2) + "\n");
}

Section NextViewsSection(const MapReconstruction& map, const NextViews& next) {
  Section section;
  if (!(next.surface_su2 > 0)) return section;
  section.title = "Where to fly next";
  if (next.views.empty()) {
    section.paragraphs = {
        "Nothing large is hidden, thin or seen from one side alone: no further view is proposed."};
    return section;
  }
  section.paragraphs = {
      "Views that would show most of what is hidden or weak, the best first, each beside those "
      "before it. Fly past each of them sideways: depth needs several images from places apart. "
      "Obstacles that the model does not show are not known. Positions and directions are in "
      "next_views.json" +
      std::string(map.georeference ? ", on the map in next_views.kml" : "") +
      ", and mono3d-view shows them."};
  Figure figure;
  figure.name = "next_views";
  figure.image = NextViewsPicture(map, next);
  figure.caption = "From above: from where to look, and at what.";
  figure.alternative = "the model from above, with arrows from the proposed views to their targets";
  figure.jpeg_quality = 82;
  section.figures = {figure};
  Table table;
  table.columns = {"view", "why", "gain", map.georeference ? "at x, y, z, m" : "at x, y, z",
                   "looks along"};
  const auto text = [](const Eigen::Vector3d& v, int decimals) {
    return FormatFixed(v.x(), decimals) + ", " + FormatFixed(v.y(), decimals) + ", " +
           FormatFixed(v.z(), decimals);
  };
  for (const NextView& view : next.views) {
    const Pose& T_world_cam = view.T_world_cam;
    table.rows.push_back({std::to_string(table.rows.size() + 1), Explanation(view.MainNeed()),
                          FormatPercent(view.Gain() / next.surface_su2, 1),
                          text(T_world_cam.translation(), 2),
                          text(T_world_cam.rotation() * Eigen::Vector3d::UnitZ(), 2)});
  }
  table.notes = {"Gain: area, of that of the model's surface."};
  section.tables = {table};
  return section;
}

}  // namespace mono3d::tools
