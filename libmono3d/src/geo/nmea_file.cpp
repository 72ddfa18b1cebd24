// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/nmea_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "geo/position_text.h"
#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using NmeaFields = std::vector<std::string_view>;

// The fields of "$GPGGA,a,b*47" from the sentence's name on; nothing where it is no sentence or its
// checksum is another one.
std::optional<NmeaFields> SplitSentence(std::string_view line) {
  line = TrimBlanks(line);
  if (line.size() < 7 || line.front() != '$') return std::nullopt;
  line.remove_prefix(1);
  const std::size_t star = line.find('*');
  if (star != std::string_view::npos) {
    if (line.size() < star + 3) return std::nullopt;
    unsigned sum = 0;
    for (const char c : line.substr(0, star)) sum ^= static_cast<std::uint8_t>(c);
    constexpr std::string_view kHexadecimal = "0123456789ABCDEF";
    const std::string told = {kHexadecimal[sum >> 4U], kHexadecimal[sum & 15U]};
    if (!EqualsIgnoringCase(told, line.substr(star + 1, 2))) return std::nullopt;
    line = line.substr(0, star);
  }
  NmeaFields fields;
  while (true) {
    const std::size_t comma = std::min(line.find(','), line.size());
    fields.push_back(line.substr(0, comma));
    if (comma == line.size()) return fields;
    line.remove_prefix(comma + 1);
  }
}

// "4916.45" and "S": degrees and minutes.
std::optional<double> ParseDegreesMinutes(std::string_view text, std::string_view hemisphere) {
  const std::optional<double> number = ParseNumber(text);
  if (!number || *number < 0 || hemisphere.size() != 1) return std::nullopt;
  const double degrees = std::floor(*number / 100);
  const double value = degrees + (*number - 100 * degrees) / 60;
  switch (hemisphere.front()) {
    case 'N':
    case 'E':
      return value;
    case 'S':
    case 'W':
      return -value;
    default:
      return std::nullopt;
  }
}

// "123519.25" in seconds of the day.
std::optional<double> ParseNmeaTime(std::string_view text) {
  const std::optional<double> number = ParseNumber(text);
  if (!number || *number < 0 || text.size() < 6) return std::nullopt;
  const double hours = std::floor(*number / 1e4);
  const double minutes = std::floor((*number - 1e4 * hours) / 100);
  const double seconds = *number - 1e4 * hours - 100 * minutes;
  if (hours > 23 || minutes > 59 || seconds > 61) return std::nullopt;
  return 3600 * hours + 60 * minutes + seconds;
}

// "230394": day, month, year; seconds since 1970 at its midnight.
std::optional<double> ParseNmeaDate(std::string_view text) {
  if (text.size() != 6) return std::nullopt;
  const std::string date = "20" + std::string(text.substr(4, 2)) + "-" +
                           std::string(text.substr(2, 2)) + "-" + std::string(text.substr(0, 2)) +
                           " 00:00:00";
  return ParseDateTime(date);
}

class NmeaReader {
 public:
  // `date_s`: midnight before the first sentence, in seconds since 1970.
  NmeaReader(const std::filesystem::path& path, double date_s)
      : builder_(path.string(), "NMEA 0183", PositionClock::kUnix), midnight_s_(date_s) {}

  void Read(std::string_view line, std::size_t line_number) {
    if (TrimBlanks(line).empty() || TrimBlanks(line).front() != '$') return;
    const std::optional<NmeaFields> fields = SplitSentence(line);
    if (!fields) {
      builder_.AddUnreadable(line_number, "the checksum is wrong or the sentence is cut off");
      return;
    }
    const std::string_view name = (*fields)[0];
    const auto is = [&](std::string_view type, std::size_t num_fields) {
      return name.size() == 5 && name.ends_with(type) && fields->size() >= num_fields;
    };
    if (is("GST", 9)) ReadErrors(*fields);
    if (is("GGA", 10)) ReadFix(*fields, line_number);
  }

  PositionTrack Finish() {
    AddPending();
    return builder_.Finish();
  }

 private:
  // GST: time, rms, semi-major, semi-minor, orientation, latitude, longitude, altitude: one
  // standard deviation each, of the fix at the same time.
  void ReadErrors(const NmeaFields& fields) {
    if (!pending_) return;
    const std::optional<double> latitude_m = ParseNumber(fields[6]);
    const std::optional<double> longitude_m = ParseNumber(fields[7]);
    const std::optional<double> altitude_m = ParseNumber(fields[8]);
    if (latitude_m && longitude_m && *latitude_m > 0 && *longitude_m > 0) {
      pending_->sigma_horizontal_m =
          std::sqrt((*latitude_m * *latitude_m + *longitude_m * *longitude_m) / 2);
    }
    if (altitude_m && *altitude_m > 0) pending_->sigma_vertical_m = *altitude_m;
  }

  // GGA: time, latitude, N, longitude, E, quality, satellites, hdop, altitude, M, ...
  void ReadFix(const NmeaFields& fields, std::size_t line_number) {
    AddPending();
    if (fields[6] == "0" || fields[2].empty()) {
      builder_.AddWithoutPosition(line_number);
      return;
    }
    const std::optional<double> time_s = ParseNmeaTime(fields[1]);
    const std::optional<double> latitude = ParseDegreesMinutes(fields[2], fields[3]);
    const std::optional<double> longitude = ParseDegreesMinutes(fields[4], fields[5]);
    if (!time_s || !latitude || !longitude) {
      builder_.AddUnreadable(line_number, "time, latitude or longitude is no number");
      return;
    }
    constexpr double kDay_s = 86'400;
    if (last_time_of_day_s_ && *time_s < *last_time_of_day_s_ - kDay_s / 2) midnight_s_ += kDay_s;
    last_time_of_day_s_ = time_s;
    PositionFix fix;
    fix.time_s = midnight_s_ + *time_s;
    fix.latitude_deg = *latitude;
    fix.longitude_deg = *longitude;
    fix.altitude_m = ParseNumber(fields[9]);
    fix.line = line_number;
    // Minutes have two digits more than degrees would.
    pending_decimals_ = CountDecimals(fields[2]) + 2;
    pending_ = fix;
  }

  void AddPending() {
    if (pending_) builder_.Add(*pending_, pending_decimals_);
    pending_.reset();
  }

  PositionTrackBuilder builder_;
  std::optional<PositionFix> pending_;  // until the sentences of its time have been read
  int pending_decimals_ = -1;
  double midnight_s_;  // before the latest fix
  std::optional<double> last_time_of_day_s_;
};

// The first date that an RMC sentence tells; 0 where none does.
double FirstDate(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    const std::optional<NmeaFields> fields = SplitSentence(line);
    if (!fields || fields->size() < 10 || !(*fields)[0].ends_with("RMC")) continue;
    if (const std::optional<double> date_s = ParseNmeaDate((*fields)[9])) return *date_s;
  }
  return 0;
}

}  // namespace

bool IsNmeaFile(const std::vector<std::string>& lines) {
  constexpr std::size_t kNumFirst = 20;
  for (std::size_t i = 0; i < std::min(kNumFirst, lines.size()); ++i) {
    const std::optional<NmeaFields> fields = SplitSentence(lines[i]);
    if (fields && (*fields)[0].size() == 5) return true;
  }
  return false;
}

PositionTrack ParseNmea(const std::filesystem::path& path, const std::vector<std::string>& lines) {
  NmeaReader reader(path, FirstDate(lines));
  for (std::size_t i = 0; i < lines.size(); ++i) reader.Read(lines[i], i + 1);
  return reader.Finish();
}

}  // namespace mono3d
