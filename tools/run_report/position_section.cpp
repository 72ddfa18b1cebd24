// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "drawing/chart.h"
#include "run_report/run_sections.h"

namespace mono3d::tools {
namespace {

constexpr double kPlotLeft = 70, kPlotRight = 950, kAxisHeight = 110,
                 kRowGap = 16;  // of the drawing, 960 wide

std::string WithSigmaOf(double value, double sigma, int digits, const char* unit) {
  return FormatFixed(value, digits) + " ± " + FormatFixed(sigma, digits) + unit;
}

std::string SigmaOnly(double sigma, int digits, const char* unit) {
  return "± " + FormatFixed(sigma, digits) + unit;
}

Table GeoreferenceTable(const Georeference& found) {
  constexpr double kDegree = std::numbers::pi / 180;
  Table table;
  table.title = "How sure it is";
  table.columns = {"", ""};
  table.rows = {
      {"origin (x east, y north, z up, m)",
       FormatFixed(found.origin.latitude_deg, 7) + "°, " +
           FormatFixed(found.origin.longitude_deg, 7) + "°, " +
           FormatFixed(found.origin.altitude_m, 2) +
           (found.has_altitude ? " m" : " m, from where the drone counts")},
      {"scale", SigmaOnly(100 * found.scale_sigma, 2, " %")},
      {"heading", SigmaOnly(found.heading_sigma_rad / kDegree, 2, "°")},
      {"tilt", SigmaOnly(found.tilt_sigma_rad / kDegree, 2, "°")},
      {"place, east, north, up", SigmaOnly(found.position_sigma_m.x(), 2, " m, ") +
                                     SigmaOnly(found.position_sigma_m.y(), 2, " m, ") +
                                     SigmaOnly(found.position_sigma_m.z(), 2, " m")},
  };
  if (!found.is_by_control) {
    table.rows.push_back({"fixes used", std::to_string(found.num_used) + " of " +
                                            std::to_string(found.residuals.size()) +
                                            " that belong to an image"});
    table.rows.push_back({"they differ from the cameras by (RMS)",
                          FormatFixed(found.rms_horizontal_m, 2) + " m horizontally, " +
                              FormatFixed(found.rms_vertical_m, 2) + " m up"});
  }
  if (found.clock_offset_sigma_s > 0) {
    table.rows.push_back({"clock of the images ahead of that of the fixes by",
                          WithSigmaOf(found.clock_offset_s, found.clock_offset_sigma_s, 2, " s")});
  }
  return table;
}

std::string InCentimetres(double metres) { return FormatFixed(100 * metres, 1); }

// What became of a ground control point.
std::string FateOf(const ControlResidual& residual, bool is_by_control) {
  return residual.is_check  ? "check point"
         : residual.is_used ? "used"
         : is_by_control    ? "left out"
                            : "not used";
}

}  // namespace

std::string FaultOf(const ControlResidual& residual) {
  std::string fault = residual.why_unused;
  std::string images;
  for (const std::string& image : residual.contradicting_images) {
    images += (images.empty() ? "" : ", ") + image;
  }
  if (!images.empty()) {
    fault += (fault.empty() ? "" : "; ") + ("its mark contradicts the others in " + images);
  }
  return fault;
}

namespace {

Table ControlTable(const Georeference& found) {
  Table table;
  table.title = "Ground control points: map minus survey";
  table.columns = {"point", "east, cm", "north, cm", "up, cm", "in the images, px", "marks", ""};
  for (const ControlResidual& residual : found.control) {
    std::vector<std::string> row = {residual.name, "", "", "", ""};
    if (residual.is_seen) {
      row = {residual.name, InCentimetres(residual.enu_m.x()), InCentimetres(residual.enu_m.y()),
             residual.has_height ? InCentimetres(residual.enu_m.z()) : "",
             FormatFixed(residual.rms_px, 1)};
    }
    row.push_back(std::to_string(residual.num_marks_used) + " of " +
                  std::to_string(residual.num_marks));
    row.push_back(FateOf(residual, found.is_by_control));
    table.rows.push_back(std::move(row));
    const std::string fault = FaultOf(residual);
    if (!fault.empty()) table.notes.push_back(residual.name + ": " + fault + ".");
  }
  return table;
}

// Root of the mean square of the check points' residuals, per axis.
std::string CheckText(const Georeference& found) {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double num_points = 0, num_heights = 0;
  for (const ControlResidual& residual : found.control) {
    if (!residual.is_check || !residual.is_seen) continue;
    squares += residual.enu_m.cwiseAbs2();
    ++num_points;
    num_heights += residual.has_height ? 1 : 0;
  }
  if (num_points == 0) return {};
  return "The check points, which took no part, are off by " +
         InCentimetres(std::sqrt(squares.x() / num_points)) + " cm east, " +
         InCentimetres(std::sqrt(squares.y() / num_points)) + " cm north, " +
         InCentimetres(std::sqrt(squares.z() / std::max(1.0, num_heights))) +
         " cm up (root mean square of " + FormatFixed(num_points, 0) + ").";
}

std::string SvgNumber(double value) { return FormatFixed(value, 1); }

// What each fix differs by from its camera, over time: a row for east, north and up each.
std::string ResidualSvg(const std::vector<PositionResidual>& residuals, bool are_photos) {
  double first_s = residuals.front().time_s, last_s = first_s, largest_m = 0;
  for (const PositionResidual& residual : residuals) {
    first_s = std::min(first_s, residual.time_s);
    last_s = std::max(last_s, residual.time_s);
    if (!residual.is_outlier) largest_m = std::max(largest_m, residual.enu_m.cwiseAbs().maxCoeff());
  }
  largest_m = std::max(largest_m, 1e-3);
  const double span_s = std::max(last_s - first_s, 1e-9);
  const double height = 3 * (kAxisHeight + kRowGap) + 32;
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 960 " +
                    SvgNumber(height) + "\" width=\"960\" height=\"" + SvgNumber(height) +
                    "\" font-family=\"sans-serif\" font-size=\"13\">\n<g fill=\"currentColor\">\n";
  const auto text = [&svg](double x, double y, const char* anchor, const std::string& words) {
    svg += "<text x=\"" + SvgNumber(x) + "\" y=\"" + SvgNumber(y) + "\" text-anchor=\"" + anchor +
           "\">" + EscapeHtml(words) + "</text>\n";
  };
  // Photographs without times are numbered in the order of their names.
  const bool has_numbers = are_photos && !residuals.front().taken_s;
  const auto time = [&](double time_s) {
    return has_numbers ? "photograph " + FormatFixed(time_s, 0) : FormatFixed(time_s, 1) + " s";
  };
  constexpr std::array<const char*, 3> kAxes = {"east", "north", "up"};
  for (int axis = 0; axis < 3; ++axis) {
    const double top = axis * (kAxisHeight + kRowGap) + 12, middle = top + kAxisHeight / 2;
    for (const double share : {-1.0, 0.0, 1.0}) {
      const double y = middle - share * kAxisHeight / 2;
      svg += "<line x1=\"" + SvgNumber(kPlotLeft) + "\" x2=\"" + SvgNumber(kPlotRight) +
             "\" y1=\"" + SvgNumber(y) + "\" y2=\"" + SvgNumber(y) +
             "\" stroke=\"currentColor\" stroke-opacity=\".25\"/>\n";
      text(kPlotLeft - 6, y + 4, "end", ShortText(share * largest_m));
    }
    text(0, middle + 4, "start", kAxes[static_cast<std::size_t>(axis)]);
    for (const PositionResidual& residual : residuals) {
      const double x = kPlotLeft + (kPlotRight - kPlotLeft) * (residual.time_s - first_s) / span_s;
      const double share = std::clamp(residual.enu_m[axis] / largest_m, -1.0, 1.0);
      svg += "<circle cx=\"" + SvgNumber(x) + "\" cy=\"" +
             SvgNumber(middle - share * kAxisHeight / 2) + "\" r=\"2.2\" fill=\"" +
             (residual.is_outlier ? "#c8382e" : "#3a78c2") + "\"/>\n";
    }
  }
  text(kPlotLeft, height - 6, "start", time(first_s));
  text(kPlotRight, height - 6, "end", time(last_s));
  return svg + "</g>\n</svg>\n";
}

}  // namespace

Section PositionSection(const RunReport& report) {
  Section section;
  const std::vector<MapReconstruction>& maps = report.reconstruction.maps;
  if (maps.empty()) return section;
  const MapReconstruction& map = maps.front();
  if (!map.georeference && map.why_no_georeference.empty()) return section;
  section.title = "On the earth";
  if (!map.georeference) {
    section.paragraphs = {"There are positions, but the model is not placed by them: " +
                          map.why_no_georeference + "."};
    return section;
  }
  const Georeference& found = *map.georeference;
  section.paragraphs = {
      "The positions that the drone wrote put the model on the earth: x is east, y north, z up, in "
      "metres. Each standard deviation is what is left of the positions' errors when all of them "
      "are taken together."};
  if (found.is_by_control) {
    section.paragraphs = {
        "Ground control points put the model on the earth: x is east, y north, z up, in metres. "
        "Each standard deviation is what is left of their errors and of those of their marks."};
  } else if (!found.why_no_control.empty()) {
    section.paragraphs.push_back(
        "Ground control points are not used, and show how far the model "
        "is off: " +
        found.why_no_control + ".");
  }
  if (const std::string check = CheckText(found); !check.empty()) {
    section.paragraphs.push_back(check);
  }
  section.tables = {GeoreferenceTable(found)};
  if (!found.control.empty()) section.tables.push_back(ControlTable(found));
  if (!found.residuals.empty()) {
    Figure figure;
    figure.name = "positions";
    figure.svg = ResidualSvg(found.residuals, report.record.are_photos);
    figure.caption =
        "What each fix differs by from its camera, m. Slow waves are those of the receiver; red "
        "ones were left out.";
    figure.alternative = "Differences between fixes and cameras over time";
    figure.is_wide = true;
    section.figures = {figure};
  }
  return section;
}

}  // namespace mono3d::tools
