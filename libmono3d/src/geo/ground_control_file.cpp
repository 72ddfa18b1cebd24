// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/ground_control_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include "geo/position_text.h"
#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr const char* kControlHead =
    "a coordinate system such as EPSG:25832 or WGS84 UTM 32N on the first line";
constexpr const char* kControlRow = "expected: x y z pixel_x pixel_y image [name]";

bool IsControlComment(std::string_view line) {
  line = TrimBlanks(line);
  return line.empty() || line.starts_with('#');
}

std::string UpperCased(std::string_view text) {
  std::string upper(text);
  for (char& c : upper) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return upper;
}

// "32N" of "WGS84 UTM 32N" as a code; empty where it is none.
std::string CodeOfZone(std::string_view zone) {
  if (zone.size() < 2) return {};
  const char hemisphere = zone.back();
  const std::optional<std::int64_t> number = ParseInteger(zone.substr(0, zone.size() - 1));
  const bool is_zone = number && *number >= 1 && *number <= 60;
  if (!is_zone || (hemisphere != 'N' && hemisphere != 'S')) return {};
  const std::string digits = (*number < 10 ? "0" : "") + std::to_string(*number);
  return (hemisphere == 'N' ? "EPSG:326" : "EPSG:327") + digits;
}

// A number of a coordinate or a pixel.
std::optional<double> ControlNumber(const std::vector<std::string_view>& words, std::size_t at) {
  return at < words.size() ? ParseNumber(words[at]) : std::nullopt;
}

bool IsMissing(std::string_view word) {
  return word == "-" || EqualsIgnoringCase(word, "nan") || EqualsIgnoringCase(word, "none");
}

// Where the pixel's columns begin: 3, or 2 where z is left out. 0: neither.
std::size_t PixelColumn(const std::vector<std::string_view>& words) {
  const auto is_number = [&](std::size_t at) { return ControlNumber(words, at).has_value(); };
  if (!is_number(0) || !is_number(1)) return 0;
  const bool has_z_column =
      words.size() >= 6 && is_number(3) && is_number(4) && (is_number(2) || IsMissing(words[2]));
  if (has_z_column) return 3;
  return words.size() >= 5 && is_number(2) && is_number(3) ? 2 : 0;
}

// Puts marks together to points.
class ControlReader {
 public:
  explicit ControlReader(const std::filesystem::path& path) { file_.source = path.string(); }

  void ReadSystem(std::string_view line, const std::string& where) {
    const std::vector<std::string_view> words = Words(line);
    const std::string first = UpperCased(words.front());
    if (first == "ENU") {
      const auto latitude = ControlNumber(words, 1), longitude = ControlNumber(words, 2);
      if (!latitude || !longitude || std::abs(*latitude) > 90 || std::abs(*longitude) > 180) {
        throw Error(ErrorParts{.what = "local metres need a place",
                               .where = where,
                               .expected = "ENU latitude longitude altitude",
                               .found = std::string(line)});
      }
      file_.system = "ENU";
      file_.origin = Geodetic{*latitude, *longitude, ControlNumber(words, 3).value_or(0)};
      return;
    }
    if (first == "WGS84" && words.size() == 3 && UpperCased(words[1]) == "UTM") {
      file_.system = CodeOfZone(UpperCased(words[2]));
    } else if (first.starts_with("EPSG:") && words.size() == 1) {
      file_.system = first;
    } else if (first == "WGS84" && words.size() == 1) {
      file_.system = "EPSG:4326";
    } else if (first.starts_with("+PROJ=")) {
      file_.system = line;
    }
    if (file_.system.empty()) {
      throw Error(ErrorParts{.what = "ground control points without a coordinate system",
                             .where = where,
                             .expected = kControlHead,
                             .found = std::string(line)});
    }
  }

  void ReadMark(std::string_view line, std::size_t number) {
    const std::vector<std::string_view> words = Words(line);
    const std::size_t at = PixelColumn(words);
    if (at == 0) {
      AddUnreadable(number, kControlRow);
      return;
    }
    SurveyedPoint point;
    point.x = *ControlNumber(words, 0);
    point.y = *ControlNumber(words, 1);
    if (at == 3) point.z = ControlNumber(words, 2);
    ControlMark mark;
    mark.pixel = {*ControlNumber(words, at), *ControlNumber(words, at + 1)};
    mark.image = std::filesystem::path(std::string(words[at + 2])).filename().string();
    mark.line = number;
    if (mark.image.empty()) {
      AddUnreadable(number, kControlRow);
      return;
    }
    for (std::size_t i = at + 3; i < words.size(); ++i) {
      if (EqualsIgnoringCase(words[i], "check")) {
        point.is_check = true;
      } else if (i == at + 3) {
        point.name = words[i];
      }
    }
    Add(std::move(point), std::move(mark));
  }

  GroundControlFile Finish() {
    if (file_.points.empty()) {
      throw Error(ErrorParts{.what = "there is no ground control point",
                             .where = file_.source,
                             .expected = "x y z pixel_x pixel_y image [name]",
                             .found = file_.first_unreadable});
    }
    return std::move(file_);
  }

 private:
  using Place = std::tuple<double, double, std::optional<double>>;

  void AddUnreadable(std::size_t line, const std::string& why) {
    ++file_.num_unreadable;
    if (file_.first_unreadable.empty()) {
      file_.first_unreadable = "line " + std::to_string(line) + ": " + why;
    }
  }

  void Add(SurveyedPoint point, ControlMark mark) {
    const Place place(point.x, point.y, point.z);
    const auto [found, is_new] = place_of_name_.emplace(point.name, place);
    if (!point.name.empty() && !is_new && found->second != place) {
      AddUnreadable(mark.line, "point " + point.name + " is in another place on a line before");
      return;
    }
    const auto [known, is_first] =
        number_of_.emplace(std::pair(point.name, place), file_.points.size());
    if (is_first) {
      if (point.name.empty()) point.name = "point " + std::to_string(file_.points.size() + 1);
      file_.points.push_back(std::move(point));
    }
    SurveyedPoint& target = file_.points[known->second];
    target.is_check = target.is_check || (!is_first && point.is_check);
    const bool is_marked = std::ranges::any_of(
        target.marks, [&](const ControlMark& other) { return other.image == mark.image; });
    if (is_marked) {
      AddUnreadable(mark.line, target.name + " is marked twice in " + mark.image);
      return;
    }
    target.marks.push_back(std::move(mark));
  }

  GroundControlFile file_;
  std::map<std::string, Place> place_of_name_;
  std::map<std::pair<std::string, Place>, std::size_t> number_of_;
};

}  // namespace

bool IsWgs84(const std::string& system) { return system == "EPSG:4326" || system == "EPSG:4979"; }

GroundControlFile ReadGroundControlFile(const std::filesystem::path& path) {
  const std::vector<std::string> lines = ReadLines(path);
  ControlReader reader(path);
  bool has_system = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (IsControlComment(lines[i])) continue;
    if (has_system) {
      reader.ReadMark(lines[i], i + 1);
    } else {
      reader.ReadSystem(TrimBlanks(lines[i]), AtLine(path, i + 1));
      has_system = true;
    }
  }
  return reader.Finish();
}

}  // namespace mono3d
