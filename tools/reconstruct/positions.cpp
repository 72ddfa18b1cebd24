// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/positions.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/printable.h"
#include "mono3d/geo/position_file.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

std::optional<PositionTrack> FindBesideInput(const std::string& input) {
  try {
    return ReadPositionsOf(input);
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string("positions are not used: ") + error.what());
    return std::nullopt;
  }
}

// Nothing is there yet, or no whole entry.
std::optional<PositionTrack> NoneYet(const fs::path& file) {
  std::error_code error;
  if (fs::exists(file, error) && fs::file_size(file, error) > 0) return std::nullopt;
  // Where there is no folder, none will come.
  if (!fs::is_directory(fs::absolute(file, error).parent_path(), error)) return std::nullopt;
  PositionTrack track;
  track.source = file.string();
  return track;
}

std::string Format(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace

void AddPositionOptions(CLI::App& app, PositionArguments& arguments) {
  app.add_option("--positions", arguments.source,
                 "where the drone was: auto (default; EXIF of photographs, telemetry such as .SRT "
                 "beside a video or in its subtitles), none, or a file: .SRT, GPX, NMEA, CSV, "
                 "geo.txt; in a live run it may be written meanwhile");
}

std::optional<PositionTrack> FindPositions(const std::string& input,
                                           const PositionArguments& arguments, bool is_live) {
  if (arguments.source == "none") return std::nullopt;
  if (const auto file = PositionsToWatch(arguments, is_live)) {
    if (std::optional<PositionTrack> none = NoneYet(*file)) {
      std::printf("positions: none yet in %s\n", Printable(arguments.source).c_str());
      return none;
    }
  }
  std::optional<PositionTrack> track =
      arguments.source == "auto" ? FindBesideInput(input) : ReadPositionFile(arguments.source);
  if (!track) return track;
  std::printf("positions: %zu, %s", track->fixes.size(), track->form.c_str());
  if (track->clock != PositionClock::kImages) {
    std::printf(" (%s)", Printable(fs::path(track->source).filename().string()).c_str());
  }
  if (track->num_unreadable > 0) {
    std::printf("; %zu entries cannot be read, the first in %s", track->num_unreadable,
                Printable(track->first_unreadable).c_str());
  }
  std::printf("\n");
  return track;
}

std::optional<fs::path> PositionsToWatch(const PositionArguments& arguments, bool is_live) {
  if (!is_live || arguments.source == "none" || arguments.source == "auto") return std::nullopt;
  return arguments.source;
}

std::string GeoreferenceLine(const MapReconstruction& map) {
  if (!map.why_no_georeference.empty()) {
    return "not on the earth: " + map.why_no_georeference;
  }
  if (!map.georeference) return {};
  const Georeference& georeference = *map.georeference;
  constexpr double kDegree = std::numbers::pi / 180;
  std::string line =
      "on the earth: scale +- " + Format("%.2g %%", 100 * georeference.scale_sigma) +
      ", heading +- " + Format("%.2g degrees", georeference.heading_sigma_rad / kDegree) +
      ", position +- " +
      Format("%.2g m",
             std::hypot(georeference.position_sigma_m.x(), georeference.position_sigma_m.y()));
  if (georeference.has_altitude) {
    line += ", height +- " + Format("%.2g m", georeference.position_sigma_m.z());
  }
  if (!georeference.is_by_control) {
    line += "; " + std::to_string(georeference.num_used) + " of " +
            std::to_string(georeference.residuals.size()) + " positions used, off by " +
            Format("%.2g m", georeference.rms_horizontal_m);
  }
  if (map.position_fit) {
    line += ", the path bent by " + Format("%.2g m", map.position_fit->rms_moved_m);
  }
  if (georeference.clock_offset_sigma_s > 0) {
    line += ", clock " + Format("%+.2f", georeference.clock_offset_s) + " +- " +
            Format("%.2g s", georeference.clock_offset_sigma_s);
  }
  return line;
}

}  // namespace mono3d::tools
