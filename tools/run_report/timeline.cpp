// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/timeline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>

#include "report/table.h"

namespace mono3d::tools {
namespace {

constexpr double kDrawingWidth = 960;
constexpr double kRowLeft = 130;
constexpr double kRowRight = 950;
constexpr double kRowHeight = 22;
constexpr double kRowStep = 38;
constexpr const char* kGood = "#2e8b57";
constexpr const char* kFair = "#e0a020";
constexpr const char* kBad = "#c8382e";
constexpr const char* kBlue = "#3a78c2";

std::string Coordinate(double value) { return FormatFixed(value, 1); }

// Frames to pixels.
struct FrameAxis {
  std::int64_t first = 0;
  std::int64_t last = 1;
  double At(double frame) const {
    const double share =
        (frame - static_cast<double>(first)) / std::max(1.0, static_cast<double>(last - first + 1));
    return kRowLeft + (kRowRight - kRowLeft) * std::clamp(share, 0.0, 1.0);
  }
};

std::string SvgText(double x, double y, const std::string& anchor, const std::string& words) {
  return "<text x=\"" + Coordinate(x) + "\" y=\"" + Coordinate(y) + "\" text-anchor=\"" + anchor +
         "\">" + EscapeHtml(words) + "</text>\n";
}

std::string SvgBar(const FrameAxis& axis, double first, double end, double y,
                   const std::string& colour, const std::string& title) {
  const double x = axis.At(first);
  const double width = std::max(0.7, axis.At(end) - x);
  return "<rect x=\"" + Coordinate(x) + "\" y=\"" + Coordinate(y) + "\" width=\"" +
         Coordinate(width) + "\" height=\"" + Coordinate(kRowHeight) + "\" fill=\"" + colour +
         "\"><title>" + EscapeHtml(title) + "</title></rect>\n";
}

std::string SvgBegin(double height) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + Coordinate(kDrawingWidth) +
         " " + Coordinate(height) + "\" width=\"960\" height=\"" + Coordinate(height) +
         "\" font-family=\"sans-serif\" font-size=\"13\">\n<g fill=\"currentColor\">\n";
}

std::string SvgFrameTicks(const FrameAxis& axis, bool are_photos, double y) {
  const double span = static_cast<double>(axis.last - axis.first + 1);
  const double power = std::pow(10, std::floor(std::log10(std::max(1.0, span / 8))));
  const double ratio = span / 8 / power;
  const double step = std::max(1.0, power * (ratio > 5 ? 10 : ratio > 2 ? 5 : ratio > 1 ? 2 : 1));
  std::string svg;
  const double first_tick = std::ceil(static_cast<double>(axis.first) / step) * step;
  for (double frame = first_tick; frame <= static_cast<double>(axis.last); frame += step) {
    svg += SvgText(axis.At(frame), y, "middle", FormatFixed(frame, 0));
  }
  return svg + SvgText(0, y, "start", are_photos ? "photograph" : "frame");
}

const char* ColourOf(FrameFate fate) {
  return fate == FrameFate::kTracked ? kGood : fate == FrameFate::kRecovered ? kFair : kBad;
}

const char* WordOf(FrameFate fate) {
  return fate == FrameFate::kTracked     ? "with a pose when it came"
         : fate == FrameFate::kRecovered ? "with a pose later"
                                         : "no pose";
}

// Frames with one fate, one after the other, are one bar.
std::string PoseRow(const FrameAxis& axis, const std::vector<FrameOutcome>& outcomes, double y) {
  std::string svg;
  for (std::size_t i = 0; i < outcomes.size();) {
    std::size_t end = i;
    while (end < outcomes.size() && outcomes[end].fate == outcomes[i].fate) ++end;
    const std::int64_t next = end < outcomes.size() ? outcomes[end].frame_index : axis.last + 1;
    const std::string frames =
        std::to_string(outcomes[i].frame_index) + " to " + std::to_string(next - 1);
    svg += SvgBar(axis, static_cast<double>(outcomes[i].frame_index), static_cast<double>(next), y,
                  ColourOf(outcomes[i].fate), frames + ": " + WordOf(outcomes[i].fate));
    i = end;
  }
  return svg;
}

std::string Ticks(const FrameAxis& axis, const std::map<std::int64_t, bool>& frames, double y,
                  const std::string& colour) {
  std::string good;
  std::string bad;
  for (const auto& [frame, is_good] : frames) {
    (is_good ? good : bad) += "M" + Coordinate(axis.At(static_cast<double>(frame) + 0.5)) + " " +
                              Coordinate(y) + "v" + Coordinate(kRowHeight);
  }
  return "<path stroke=\"" + colour + "\" stroke-width=\"1.5\" d=\"" + good +
         "\"/>\n<path stroke=\"" + std::string(kBad) + "\" stroke-width=\"1.5\" d=\"" + bad +
         "\"/>\n";
}

std::string HealthRow(const FrameAxis& axis, const MapReconstruction& map, double y) {
  std::string svg;
  std::int64_t first = axis.first;
  HealthState state = HealthState::kGood;
  const auto add = [&](std::int64_t end) {
    const char* colour = state == HealthState::kGood       ? kGood
                         : state == HealthState::kDegraded ? kFair
                                                           : kBad;
    if (end > first) {
      svg += SvgBar(axis, static_cast<double>(first), static_cast<double>(end), y, colour,
                    ToString(state));
    }
  };
  for (const HealthChange& change : map.health_changes) {
    // A depth map is of a keyframe that came before: changes need not be in the frames' order.
    const std::int64_t at = std::max(first, change.frame_index);
    add(at);
    first = at;
    state = change.state;
  }
  add(axis.last + 1);
  return svg;
}

}  // namespace

std::string TimelineSvg(const std::vector<FrameOutcome>& outcomes,
                        const Reconstruction& reconstruction, bool are_photos) {
  if (outcomes.empty()) return {};
  const FrameAxis axis{outcomes.front().frame_index, outcomes.back().frame_index};
  std::string labels;
  std::string rows;
  double y = 4;
  const auto add_row = [&](const std::string& label, const std::string& row) {
    labels += SvgText(0, y + 16, "start", label);
    rows += row;
    y += kRowStep;
  };
  add_row("Poses", PoseRow(axis, outcomes, y));
  std::map<std::int64_t, bool> keyframes;
  std::map<std::int64_t, bool> depth_maps;
  for (const MapReconstruction& map : reconstruction.maps) {
    for (const TrajectoryEntry& entry : map.keyframes) keyframes[entry.frame_index] = true;
    for (const FusionRecord& fusion : map.fusions) {
      depth_maps[fusion.frame_index] |= fusion.status == FusionStatus::kFused;
    }
  }
  add_row("Keyframes", Ticks(axis, keyframes, y, "currentColor"));
  add_row("Depth maps", Ticks(axis, depth_maps, y, kBlue));
  if (!reconstruction.maps.empty() && !reconstruction.maps[0].fusions.empty()) {
    add_row("Model", HealthRow(axis, reconstruction.maps[0], y));
  }
  labels += SvgFrameTicks(axis, are_photos, y + 6);
  return SvgBegin(y + 14) + labels + "</g>\n" + rows + "</svg>\n";
}

std::string OverlapSvg(const std::vector<KeyframeOverlap>& overlaps, bool are_photos) {
  if (overlaps.empty()) return {};
  constexpr double kTop = 8;
  constexpr double kHeight = 120;
  const FrameAxis axis{overlaps.front().frame_index, overlaps.back().frame_index};
  std::string labels;
  std::string grid;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const double y = kTop + kHeight * (1 - share);
    labels += SvgText(kRowLeft - 8, y + 4, "end", FormatPercent(share, 0));
    grid += "M" + Coordinate(kRowLeft) + " " + Coordinate(y) + "H" + Coordinate(kRowRight);
  }
  std::string points;
  for (const KeyframeOverlap& overlap : overlaps) {
    points += Coordinate(axis.At(static_cast<double>(overlap.frame_index) + 0.5)) + "," +
              Coordinate(kTop + kHeight * (1 - overlap.shared)) + " ";
  }
  labels += SvgFrameTicks(axis, are_photos, kTop + kHeight + 24);
  return SvgBegin(kTop + kHeight + 32) + labels +
         "</g>\n<path stroke=\"currentColor\" stroke-opacity=\".18\" d=\"" + grid +
         "\"/>\n<polyline class=\"curve\" fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"2\" "
         "points=\"" +
         points + "\"/>\n</svg>\n";
}

}  // namespace mono3d::tools
