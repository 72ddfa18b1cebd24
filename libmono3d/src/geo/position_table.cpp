// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_table.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <map>
#include <optional>
#include <string_view>

#include "geo/position_text.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/geodetic.h"

namespace mono3d {
namespace {

enum class Column {
  kLatitude,
  kLongitude,
  kAltitude,
  kHeight,
  kSeconds,
  kMilliseconds,
  kDateTime,
  kImage,
  kSigmaHorizontal,
  kSigmaVertical
};

// Lower-case letters and digits of a name: "OSD.latitude [deg]" is "osdlatitudedeg".
std::string PlainName(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') plain += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) plain += c;
  }
  return plain;
}

// As receivers, DJI's logs, Airdata, exiftool and OpenDroneMap write them.
std::optional<Column> ColumnOf(std::string_view name) {
  static const std::map<std::string, Column, std::less<>> kNames = {
      {"lat", Column::kLatitude},
      {"latitude", Column::kLatitude},
      {"latitudedeg", Column::kLatitude},
      {"osdlatitude", Column::kLatitude},
      {"gpslatitude", Column::kLatitude},
      {"lon", Column::kLongitude},
      {"lng", Column::kLongitude},
      {"long", Column::kLongitude},
      {"longitude", Column::kLongitude},
      {"longitudedeg", Column::kLongitude},
      {"osdlongitude", Column::kLongitude},
      {"gpslongitude", Column::kLongitude},
      {"alt", Column::kAltitude},
      {"altm", Column::kAltitude},
      {"altitude", Column::kAltitude},
      {"altitudem", Column::kAltitude},
      {"altitudeabovesealevelmeters", Column::kAltitude},
      {"absalt", Column::kAltitude},
      {"absolutealtitude", Column::kAltitude},
      {"gpsaltitude", Column::kAltitude},
      {"ele", Column::kAltitude},
      {"elevation", Column::kAltitude},
      {"height", Column::kHeight},
      {"heightm", Column::kHeight},
      {"osdheightm", Column::kHeight},
      {"heightabovetakeoffmeters", Column::kHeight},
      {"relalt", Column::kHeight},
      {"relativealtitude", Column::kHeight},
      {"t", Column::kSeconds},
      {"time", Column::kSeconds},
      {"times", Column::kSeconds},
      {"timestamp", Column::kSeconds},
      {"timestamps", Column::kSeconds},
      {"seconds", Column::kSeconds},
      {"osdflytimes", Column::kSeconds},
      {"timemillisecond", Column::kMilliseconds},
      {"timems", Column::kMilliseconds},
      {"timestampms", Column::kMilliseconds},
      {"milliseconds", Column::kMilliseconds},
      {"datetime", Column::kDateTime},
      {"datetimeutc", Column::kDateTime},
      {"date", Column::kDateTime},
      {"utc", Column::kDateTime},
      {"image", Column::kImage},
      {"imagename", Column::kImage},
      {"file", Column::kImage},
      {"filename", Column::kImage},
      {"sourcefile", Column::kImage},
      {"name", Column::kImage},
      {"label", Column::kImage},
      {"sigmahorizontal", Column::kSigmaHorizontal},
      {"sigmahorizontalm", Column::kSigmaHorizontal},
      {"horizontalaccuracy", Column::kSigmaHorizontal},
      {"hacc", Column::kSigmaHorizontal},
      {"sigmavertical", Column::kSigmaVertical},
      {"sigmaverticalm", Column::kSigmaVertical},
      {"verticalaccuracy", Column::kSigmaVertical},
      {"vacc", Column::kSigmaVertical}};
  const auto found = kNames.find(PlainName(name));
  return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

// The cells of a row, quotes taken off ("" within quotes is one).
std::vector<std::string> SplitRow(std::string_view row, char separator) {
  std::vector<std::string> cells(1);
  bool is_quoted = false;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const char c = row[i];
    if (c == '"') {
      if (is_quoted && i + 1 < row.size() && row[i + 1] == '"') {
        cells.back() += c;
        ++i;
      } else {
        is_quoted = !is_quoted;
      }
    } else if (c == separator && !is_quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

struct TableHead {
  char separator = ',';
  std::map<Column, std::size_t> columns;
};

std::optional<TableHead> ReadTableHead(const std::vector<std::string>& lines) {
  if (lines.empty()) return std::nullopt;
  for (const char separator : {',', ';', '\t'}) {
    TableHead head{separator, {}};
    std::string_view row = lines.front();
    if (row.starts_with('#')) row.remove_prefix(1);
    const std::vector<std::string> names = SplitRow(row, separator);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (const std::optional<Column> column = ColumnOf(names[i])) head.columns.emplace(*column, i);
    }
    if (head.columns.contains(Column::kLatitude) && head.columns.contains(Column::kLongitude)) {
      return head;
    }
  }
  return std::nullopt;
}

class TableReader {
 public:
  TableReader(const std::filesystem::path& path, TableHead head)
      : head_(std::move(head)), builder_(path.string(), "table", Clock()) {}

  void ReadRow(std::string_view row, std::size_t line_number) {
    cells_ = SplitRow(row, head_.separator);
    PositionFix fix;
    fix.line = line_number;
    const std::string latitude = Cell(Column::kLatitude);
    const std::string longitude = Cell(Column::kLongitude);
    if (latitude.empty() && longitude.empty()) {
      builder_.AddWithoutPosition(line_number);
      return;
    }
    const std::optional<double> latitude_deg = ParseDecimal(latitude);
    const std::optional<double> longitude_deg = ParseDecimal(longitude);
    if (!latitude_deg || !longitude_deg) {
      builder_.AddUnreadable(line_number, "latitude or longitude is no number");
      return;
    }
    fix.latitude_deg = *latitude_deg;
    fix.longitude_deg = *longitude_deg;
    if (!ReadTime(fix)) {
      builder_.AddUnreadable(line_number, "the time is no time");
      return;
    }
    fix.altitude_m = ParseDecimal(Cell(Column::kAltitude));
    fix.height_m = ParseDecimal(Cell(Column::kHeight));
    fix.sigma_horizontal_m =
        std::max(0.0, ParseDecimal(Cell(Column::kSigmaHorizontal)).value_or(0));
    fix.sigma_vertical_m = std::max(0.0, ParseDecimal(Cell(Column::kSigmaVertical)).value_or(0));
    builder_.Add(fix, std::max(CountDecimals(latitude), CountDecimals(longitude)));
  }

  PositionTrack Finish() { return builder_.Finish(); }

 private:
  bool Has(Column column) const { return head_.columns.contains(column); }

  PositionClock Clock() const {
    if (Has(Column::kImage)) return PositionClock::kImages;
    if (Has(Column::kSeconds) || Has(Column::kMilliseconds)) return PositionClock::kVideo;
    return PositionClock::kUnix;
  }

  std::string Cell(Column column) const {
    const auto found = head_.columns.find(column);
    if (found == head_.columns.end() || found->second >= cells_.size()) return {};
    return std::string(TrimBlanks(cells_[found->second]));
  }

  bool ReadTime(PositionFix& fix) const {
    if (Has(Column::kImage)) {
      fix.image = std::filesystem::path(Cell(Column::kImage)).filename().string();
      fix.time_s = ParseDateTime(Cell(Column::kDateTime)).value_or(0);
      return !fix.image.empty();
    }
    std::optional<double> time_s;
    if (Has(Column::kSeconds)) {
      time_s = ParseDecimal(Cell(Column::kSeconds));
    } else if (Has(Column::kMilliseconds)) {
      time_s = ParseDecimal(Cell(Column::kMilliseconds));
      if (time_s) *time_s /= 1000;
    } else {
      time_s = ParseDateTime(Cell(Column::kDateTime));
    }
    fix.time_s = time_s.value_or(0);
    return time_s.has_value();
  }

  TableHead head_;
  PositionTrackBuilder builder_;
  std::vector<std::string> cells_;
};

bool IsComment(std::string_view line) {
  line = TrimBlanks(line);
  return line.empty() || line.starts_with('#');
}

const std::string* FirstRow(const std::vector<std::string>& lines) {
  const auto row =
      std::ranges::find_if(lines, [](const std::string& line) { return !IsComment(line); });
  return row == lines.end() ? nullptr : &*row;
}

std::optional<std::vector<double>> NumbersOf(std::string_view line) {
  std::vector<double> numbers;
  for (const std::string_view word : Words(line)) {
    const std::optional<double> number = ParseNumber(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

// "# origin (WGS 84 latitude_deg longitude_deg altitude_m) 49.01 8.41 115"
std::optional<Geodetic> OriginOf(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    if (!line.starts_with("# origin")) continue;
    const std::size_t close = line.rfind(')');
    const std::string_view rest =
        std::string_view(line).substr(close == std::string::npos ? 8 : close + 1);
    const std::optional<std::vector<double>> numbers = NumbersOf(rest);
    if (numbers && numbers->size() == 3)
      return Geodetic{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  }
  return std::nullopt;
}

// Decimals of the coordinates as written.
int DecimalsOf(std::string_view line) {
  const std::vector<std::string_view> words = Words(line);
  return words.size() < 3 ? 0 : std::max(CountDecimals(words[1]), CountDecimals(words[2]));
}

}  // namespace

bool IsPositionTable(const std::vector<std::string>& lines) {
  return ReadTableHead(lines).has_value();
}

PositionTrack ParsePositionTable(const std::filesystem::path& path,
                                 const std::vector<std::string>& lines) {
  std::optional<TableHead> head = ReadTableHead(lines);
  const auto has = [&](Column column) { return head && head->columns.contains(column); };
  if (!has(Column::kImage) && !has(Column::kSeconds) && !has(Column::kMilliseconds) &&
      !has(Column::kDateTime)) {
    throw Error(ErrorParts{.what = "the table of positions tells neither times nor images",
                           .where = AtLine(path, 1),
                           .expected = "a column \"time\" (s), \"datetime\" or \"image\"",
                           .found = {}});
  }
  TableReader reader(path, std::move(*head));
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (!IsComment(lines[i])) reader.ReadRow(lines[i], i + 1);
  }
  return reader.Finish();
}

bool IsImagePositionList(const std::vector<std::string>& lines) {
  const std::string* row = FirstRow(lines);
  if (row == nullptr) return false;
  const std::string name = PlainName(TrimBlanks(*row));
  return name.starts_with("epsg") || name.starts_with("wgs84") || row->starts_with("+proj");
}

PositionTrack ParseImagePositionList(const std::filesystem::path& path,
                                     const std::vector<std::string>& lines) {
  const std::string* head = FirstRow(lines);
  const auto head_line = static_cast<std::size_t>(head - lines.data()) + 1;
  const std::string name = PlainName(TrimBlanks(*head));
  if (name != "epsg4326" && name != "epsg4979" && name != "wgs84") {
    throw Error(ErrorParts{.what = "positions in this coordinate system are not read",
                           .where = AtLine(path, head_line),
                           .expected = "EPSG:4326 (longitude latitude altitude)",
                           .found = *head,
                           .code = ErrorCode::kUnsupported});
  }
  PositionTrackBuilder builder(path.string(), "image positions", PositionClock::kImages);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (&lines[i] == head || IsComment(lines[i])) continue;
    const std::vector<std::string_view> words = Words(lines[i]);
    const auto number = [&](std::size_t k) {
      return k < words.size() ? ParseNumber(words[k]) : std::nullopt;
    };
    if (!number(1) || !number(2)) {
      builder.AddUnreadable(i + 1, "expected: image longitude latitude [altitude]");
      continue;
    }
    PositionFix fix;
    fix.line = i + 1;
    fix.image = std::filesystem::path(words[0]).filename().string();
    fix.longitude_deg = *number(1);
    fix.latitude_deg = *number(2);
    fix.altitude_m = number(3);
    // Further columns: yaw, pitch, roll, then the two standard deviations.
    fix.sigma_horizontal_m = std::max(0.0, number(7).value_or(0));
    fix.sigma_vertical_m = std::max(0.0, number(8).value_or(0));
    builder.Add(fix, DecimalsOf(lines[i]));
  }
  return builder.Finish();
}

bool IsPositionList(const std::vector<std::string>& lines) {
  const std::string* row = FirstRow(lines);
  if (row == nullptr) return false;
  const std::optional<std::vector<double>> numbers = NumbersOf(*row);
  return numbers && numbers->size() >= 4 && numbers->size() <= 5;
}

PositionTrack ParsePositionList(const std::filesystem::path& path,
                                const std::vector<std::string>& lines) {
  const std::optional<Geodetic> origin = OriginOf(lines);
  PositionTrackBuilder builder(path.string(), "position list", PositionClock::kVideo);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (IsComment(lines[i])) continue;
    const std::optional<std::vector<double>> numbers = NumbersOf(lines[i]);
    if (!numbers || numbers->size() < 4 || numbers->size() > 5) {
      builder.AddUnreadable(i + 1, "expected: time latitude longitude altitude [height]");
      continue;
    }
    PositionFix fix;
    fix.line = i + 1;
    fix.time_s = (*numbers)[0];
    Geodetic place{(*numbers)[1], (*numbers)[2], (*numbers)[3]};
    if (origin) place = ToGeodetic({(*numbers)[1], (*numbers)[2], (*numbers)[3]}, *origin);
    fix.latitude_deg = place.latitude_deg;
    fix.longitude_deg = place.longitude_deg;
    fix.altitude_m = place.altitude_m;
    if (!origin && numbers->size() == 5) fix.height_m = (*numbers)[4];
    builder.Add(fix, origin ? -1 : DecimalsOf(lines[i]));
  }
  return builder.Finish();
}

}  // namespace mono3d
