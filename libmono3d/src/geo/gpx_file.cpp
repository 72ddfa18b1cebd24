// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/gpx_file.h"

#include <expat.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstddef>
#include <memory>
#include <new>
#include <optional>
#include <string_view>
#include <vector>

#include "geo/position_text.h"
#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

struct GpxPoint {
  std::size_t line = 0;
  std::string latitude;
  std::string longitude;
  std::string elevation;
  std::string time;
};

// Kinds of points, the preferred one first.
constexpr std::array<std::string_view, 3> kPointNames = {"trkpt", "rtept", "wpt"};

struct GpxCollector {
  XML_Parser parser;
  std::array<std::vector<GpxPoint>, kPointNames.size()> points;
  GpxPoint* point = nullptr;    // the open one
  std::string* text = nullptr;  // the value that is open
};

// Without the prefix of its namespace.
std::string_view LocalName(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

void OnGpxStart(void* user, const XML_Char* name, const XML_Char** attributes) {
  auto& collector = *static_cast<GpxCollector*>(user);
  const std::string_view local = LocalName(name);
  const auto kind = std::ranges::find(kPointNames, local);
  if (kind != kPointNames.end()) {
    auto& points = collector.points.at(static_cast<std::size_t>(kind - kPointNames.begin()));
    collector.point = &points.emplace_back();
    collector.point->line = XML_GetCurrentLineNumber(collector.parser);
    for (; *attributes != nullptr; attributes += 2) {
      const std::string_view attribute = attributes[0];
      if (attribute == "lat") collector.point->latitude = attributes[1];
      if (attribute == "lon") collector.point->longitude = attributes[1];
    }
  }
  collector.text = nullptr;
  if (collector.point == nullptr) return;
  if (local == "ele") collector.text = &collector.point->elevation;
  if (local == "time") collector.text = &collector.point->time;
}

void OnGpxEnd(void* user, const XML_Char* name) {
  auto& collector = *static_cast<GpxCollector*>(user);
  collector.text = nullptr;
  if (std::ranges::find(kPointNames, LocalName(name)) != kPointNames.end()) {
    collector.point = nullptr;
  }
}

void OnGpxText(void* user, const XML_Char* text, int length) {
  auto& collector = *static_cast<GpxCollector*>(user);
  constexpr std::size_t kLongestValue = 64;
  if (collector.text == nullptr || collector.text->size() > kLongestValue) return;
  collector.text->append(text, static_cast<std::size_t>(length));
}

// GPX has no document type; its entities could make a small file large.
void OnGpxDocumentType(void* user, const XML_Char* /*name*/, const XML_Char* /*system_id*/,
                       const XML_Char* /*public_id*/, int /*has_internal_subset*/) {
  XML_StopParser(static_cast<GpxCollector*>(user)->parser, XML_FALSE);
}

void AddPoint(const GpxPoint& point, PositionTrackBuilder& builder) {
  const std::optional<double> latitude = ParseDecimal(point.latitude);
  const std::optional<double> longitude = ParseDecimal(point.longitude);
  const std::optional<double> time_s = ParseDateTime(point.time);
  if (!latitude || !longitude) {
    builder.AddUnreadable(point.line, "lat or lon is no number");
    return;
  }
  if (!time_s) {
    builder.AddUnreadable(point.line, "the point has no time");
    return;
  }
  PositionFix fix;
  fix.time_s = *time_s;
  fix.latitude_deg = *latitude;
  fix.longitude_deg = *longitude;
  fix.altitude_m = ParseDecimal(point.elevation);
  fix.line = point.line;
  builder.Add(fix, std::max(CountDecimals(point.latitude), CountDecimals(point.longitude)));
}

}  // namespace

PositionTrack ParseGpx(const std::filesystem::path& path, const std::string& xml) {
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
      XML_ParserCreate(nullptr), &XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  GpxCollector collector{parser.get(), {}, nullptr, nullptr};
  XML_SetUserData(parser.get(), &collector);
  XML_SetElementHandler(parser.get(), OnGpxStart, OnGpxEnd);
  XML_SetCharacterDataHandler(parser.get(), OnGpxText);
  XML_SetStartDoctypeDeclHandler(parser.get(), OnGpxDocumentType);
  if (xml.size() > INT_MAX) {
    throw Error(ErrorParts{.what = "the GPX file is too large",
                           .where = path,
                           .expected = "less than 2 GB",
                           .found = {},
                           .code = ErrorCode::kUnsupported});
  }
  const bool is_whole =
      XML_Parse(parser.get(), xml.data(), static_cast<int>(xml.size()), XML_TRUE) == XML_STATUS_OK;
  PositionTrackBuilder builder(path.string(), "GPX", PositionClock::kUnix);
  for (const std::vector<GpxPoint>& points : collector.points) {
    if (points.empty()) continue;
    for (const GpxPoint& point : points) AddPoint(point, builder);
    break;
  }
  // What stands before the damage is used.
  if (!is_whole) {
    builder.AddUnreadable(
        XML_GetCurrentLineNumber(parser.get()),
        std::string("the XML breaks off: ") + XML_ErrorString(XML_GetErrorCode(parser.get())));
  }
  return builder.Finish();
}

}  // namespace mono3d
