// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/position_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

#include "geo/dji_telemetry.h"
#include "geo/gpx_file.h"
#include "geo/nmea_file.h"
#include "geo/position_table.h"
#include "geo/position_text.h"
#include "io/image_list.h"
#include "io/photo_prior.h"
#include "io/text.h"
#include "io/video_subtitles.h"
#include "mono3d/core/error.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

constexpr const char* kForms =
    "DJI telemetry (.SRT), GPX, NMEA, a table with named columns, geo.txt or gps.txt";

bool IsXml(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return TrimBlanks(text.substr(0, 200)).starts_with('<');
}

// EXIF where XMP tells nothing; XMP has more digits and the rest.
// `is_utc_told`: by all photos, so that their times may be taken in UTC.
PositionFix FixOf(const PhotoFacts& facts, bool is_utc_told, int& num_decimals) {
  PositionFix fix;
  fix.image = facts.name;
  const std::string zone = is_utc_told ? facts.exif->taken_zone : std::string();
  if (facts.exif) fix.time_s = ParseDateTime(facts.exif->taken + zone).value_or(0);
  if (facts.exif && facts.exif->position) {
    const ExifPosition& position = *facts.exif->position;
    fix.latitude_deg = position.latitude_deg;
    fix.longitude_deg = position.longitude_deg;
    fix.altitude_m = position.altitude_m;
    fix.sigma_horizontal_m = position.sigma_horizontal_m;
    num_decimals = position.num_decimals;
  }
  if (!facts.xmp) return fix;
  const DjiXmpPosition& position = facts.xmp->position;
  if (position.latitude_deg && position.longitude_deg && *position.latitude_deg != 0) {
    fix.latitude_deg = *position.latitude_deg;
    fix.longitude_deg = *position.longitude_deg;
    num_decimals = position.num_decimals;
  }
  if (position.altitude_m) fix.altitude_m = position.altitude_m;
  fix.height_m = position.height_m;
  if (position.sigma_latitude_m > 0 && position.sigma_longitude_m > 0) {
    fix.sigma_horizontal_m = std::hypot(position.sigma_latitude_m, position.sigma_longitude_m) /
                             std::sqrt(2.0);  // of each axis
  }
  fix.sigma_vertical_m = position.sigma_height_m;
  if (position.gimbal_yaw_deg && position.gimbal_pitch_deg && position.gimbal_roll_deg) {
    fix.gimbal = GimbalAngles{*position.gimbal_yaw_deg, *position.gimbal_pitch_deg,
                              *position.gimbal_roll_deg};
  }
  return fix;
}

// Videos have subtitles of all kinds: such without positions are passed over.
std::optional<PositionTrack> PositionsInVideo(const std::filesystem::path& video) {
  if (!IsMp4(video)) return std::nullopt;
  const std::vector<VideoSubtitle> subtitles = ReadVideoSubtitles(video);
  if (subtitles.empty()) return std::nullopt;
  try {
    return ParseDjiTelemetry(video, subtitles);
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

PositionTrack ReadPositionFile(const std::filesystem::path& path) {
  if (IsMp4(path)) {
    const std::vector<VideoSubtitle> subtitles = ReadVideoSubtitles(path);
    if (!subtitles.empty()) return ParseDjiTelemetry(path, subtitles);
    throw Error(ErrorParts{.what = "the video has no subtitles with positions",
                           .where = path,
                           .expected = kForms,
                           .found = {},
                           .code = ErrorCode::kUnsupported});
  }
  const std::string bytes = ReadBytes(path);
  // A byte order mark alone is no line.
  const std::vector<std::string> lines = ReadLines(path);
  if (lines.empty() || TrimBlanks(bytes).empty()) {
    throw Error(ErrorParts{.what = "the file of positions is empty",
                           .where = AtLine(path, 1),
                           .expected = kForms,
                           .found = {}});
  }
  if (IsXml(bytes)) return ParseGpx(path, bytes);
  if (IsNmeaFile(lines)) return ParseNmea(path, lines);
  if (IsSubtitleFile(lines)) return ParseDjiTelemetry(path, lines);
  if (IsPositionTable(lines)) return ParsePositionTable(path, lines);
  if (IsImagePositionList(lines)) return ParseImagePositionList(path, lines);
  if (IsPositionList(lines)) return ParsePositionList(path, lines);
  constexpr std::size_t kMaxShown = 80;
  const bool is_text = std::ranges::none_of(
      lines.front(), [](char c) { return static_cast<unsigned char>(c) < 32 && c != '\t'; });
  throw Error(ErrorParts{.what = "not a file of positions",
                         .where = AtLine(path, 1),
                         .expected = kForms,
                         .found = !is_text ? "a file that is no text"
                                  : lines.front().size() <= kMaxShown
                                      ? lines.front()
                                      : lines.front().substr(0, kMaxShown) + " ...",
                         .code = ErrorCode::kUnsupported});
}

PositionTrack ReadPhotoPositions(const std::vector<std::string>& images) {
  PositionTrackBuilder builder(images.empty() ? std::string() : images.front(), "EXIF",
                               PositionClock::kImages);
  std::vector<std::optional<PhotoFacts>> facts_of;  // nothing: it cannot be read
  for (const std::string& image : images) {
    try {
      facts_of.emplace_back(ReadPhotoFacts(image));
    } catch (const Error&) {
      facts_of.emplace_back(std::nullopt);
    }
  }
  const bool is_utc_told = std::ranges::all_of(facts_of, [](const auto& facts) {
    return !facts || (facts->exif && !facts->exif->taken_zone.empty());
  });
  bool has_any = false;
  for (const std::optional<PhotoFacts>& facts : facts_of) {
    if (!facts) {
      builder.AddWithoutPosition(0);
      continue;
    }
    int num_decimals = 0;
    const PositionFix fix = FixOf(*facts, is_utc_told, num_decimals);
    builder.Add(fix, num_decimals);
    has_any |= fix.latitude_deg != 0 || fix.longitude_deg != 0;
  }
  return has_any ? builder.Finish() : PositionTrack{};
}

std::optional<std::filesystem::path> FindPositionFile(const std::filesystem::path& video) {
  constexpr std::array<std::string_view, 4> kExtensions = {".srt", ".gpx", ".nmea", ".csv"};
  std::error_code ignored;
  std::filesystem::directory_iterator files(
      video.has_parent_path() ? video.parent_path() : std::filesystem::path("."), ignored);
  std::optional<std::filesystem::path> found;
  std::size_t rank = kExtensions.size();
  for (; files != std::filesystem::directory_iterator(); files.increment(ignored)) {
    const std::filesystem::directory_entry& file = *files;
    if (file.path().stem() != video.stem() || !file.is_regular_file(ignored)) continue;
    const std::string extension = file.path().extension().string();
    const auto kind = std::ranges::find_if(
        kExtensions, [&](std::string_view known) { return EqualsIgnoringCase(known, extension); });
    const auto kind_rank = static_cast<std::size_t>(kind - kExtensions.begin());
    if (kind_rank >= rank) continue;
    rank = kind_rank;
    found = file.path();
  }
  return found;
}

std::optional<PositionTrack> ReadPositionsOf(const std::string& input) {
  if (KindOfInput(input) == InputKind::kVideo) {
    const std::optional<std::filesystem::path> file = FindPositionFile(input);
    return file ? std::optional(ReadPositionFile(*file)) : PositionsInVideo(input);
  }
  if (KindOfInput(input) == InputKind::kImage) return std::nullopt;
  PositionTrack track = ReadPhotoPositions(ListImages(input));
  return track.fixes.empty() ? std::nullopt : std::optional(std::move(track));
}

}  // namespace mono3d
