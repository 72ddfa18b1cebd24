// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/dji_telemetry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>

#include "geo/position_text.h"
#include "io/text.h"

namespace mono3d {
namespace {

constexpr std::string_view kArrow = "-->";

// One subtitle: what stands between its number and the next empty line.
struct Subtitle {
  std::size_t line = 0;  // of its number
  std::optional<double> begin_s;
  std::string text;  // the rest, in one line
};

bool IsNumberLine(std::string_view line) {
  line = TrimBlanks(line);
  return !line.empty() && line.size() <= 9 &&
         line.find_first_not_of("0123456789") == std::string_view::npos;
}

std::optional<double> BeginOf(std::string_view line) {
  return ParseTimeOfDay(line.substr(0, line.find(kArrow)));
}

std::vector<Subtitle> SplitSubtitles(const std::vector<std::string>& lines) {
  std::vector<Subtitle> subtitles;
  bool is_open = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string_view line = TrimBlanks(lines[i]);
    if (line.empty()) {
      is_open = false;
    } else if (!is_open && IsNumberLine(line)) {
      subtitles.push_back({i + 1, std::nullopt, {}});
      is_open = true;
    } else if (!subtitles.empty()) {
      Subtitle& subtitle = subtitles.back();
      if (line.find(kArrow) != std::string_view::npos) {
        subtitle.begin_s = BeginOf(line);
      } else {
        subtitle.text += std::string(line) + " ";
      }
      is_open = true;
    }
  }
  return subtitles;
}

struct TelemetryValue {
  std::string_view key;
  std::string_view value;
};

// Of "rel_alt: -2.400 abs_alt: 0.401" or "latitude : 41.42".
std::vector<TelemetryValue> SplitPairs(std::string_view content) {
  std::vector<TelemetryValue> values;
  while (true) {
    const std::size_t colon = content.find(':');
    if (colon == std::string_view::npos) return values;
    std::string_view key = TrimBlanks(content.substr(0, colon));
    const std::size_t blank = key.find_last_of(" \t");
    if (blank != std::string_view::npos) key.remove_prefix(blank + 1);
    content.remove_prefix(colon + 1);
    content.remove_prefix(std::min(content.find_first_not_of(" \t"), content.size()));
    const std::size_t end = std::min(content.find_first_of(" \t"), content.size());
    values.push_back({key, content.substr(0, end)});
    content.remove_prefix(end);
  }
}

// What stands between `open` and the next `close`, from `at` on; `at` moves behind it.
std::optional<std::string_view> TakeEnclosed(std::string_view text, char open, char close,
                                             std::size_t& at) {
  const std::size_t begin = text.find(open, at);
  if (begin == std::string_view::npos) return std::nullopt;
  const std::size_t end = text.find(close, begin + 1);
  if (end == std::string_view::npos) return std::nullopt;
  at = end + 1;
  return text.substr(begin + 1, end - begin - 1);
}

std::vector<std::string_view> SplitAtCommas(std::string_view text) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t comma = std::min(text.find(','), text.size());
    parts.push_back(TrimBlanks(text.substr(0, comma)));
    if (comma == text.size()) return parts;
    text.remove_prefix(comma + 1);
  }
}

// The arguments of `name(...)`: "GPS (-121.7, 48.0, 17)"; nothing where the name is not there.
std::optional<std::string_view> ArgumentsOf(std::string_view text, std::string_view name) {
  for (std::size_t at = text.find(name); at != std::string_view::npos;
       at = text.find(name, at + 1)) {
    std::size_t behind = at + name.size();
    const std::size_t bracket = text.find_first_not_of(' ', behind);
    if (bracket == std::string_view::npos || text[bracket] != '(') continue;
    return TakeEnclosed(text, '(', ')', behind);
  }
  return std::nullopt;
}

// One subtitle as a position.
class DjiEntry {
 public:
  explicit DjiEntry(const Subtitle& subtitle) : text_(subtitle.text) {
    fix_.line = subtitle.line;
    ReadBrackets();
    ReadGps();
    ReadHeights();
    ReadGimbal();
  }

  const PositionFix& fix() const { return fix_; }
  int num_decimals() const { return num_decimals_; }
  bool has_position() const { return latitude_ && longitude_; }
  bool is_unreadable() const { return is_unreadable_; }

 private:
  // [latitude: 41.42] [longtitude : 2.16] [rel_alt: 1.2 abs_alt: 30.1]
  void ReadBrackets() {
    std::size_t at = 0;
    while (const std::optional<std::string_view> content = TakeEnclosed(text_, '[', ']', at)) {
      for (const TelemetryValue& pair : SplitPairs(*content)) ReadPair(pair);
    }
    SetPosition();
  }

  void ReadPair(const TelemetryValue& pair) {
    const std::optional<double> number = ParseDecimal(pair.value);
    const auto is = [&](std::string_view name) { return EqualsIgnoringCase(pair.key, name); };
    if (is("latitude")) {
      ReadCoordinate(pair.value, number, latitude_);
    } else if (is("longitude") || is("longtitude")) {
      ReadCoordinate(pair.value, number, longitude_);
    } else if (is("altitude") || is("abs_alt")) {
      fix_.altitude_m = number;
    } else if (is("rel_alt")) {
      fix_.height_m = number;
    } else if (is("gb_yaw")) {
      yaw_ = number;
    } else if (is("gb_pitch")) {
      pitch_ = number;
    } else if (is("gb_roll")) {
      roll_ = number;
    }
  }

  void ReadCoordinate(std::string_view written, std::optional<double> number,
                      std::optional<double>& coordinate) {
    coordinate = number;
    is_unreadable_ |= !number && !EqualsIgnoringCase(written, "n/a");
    num_decimals_ = std::max(num_decimals_, CountDecimals(written));
  }

  void SetPosition() {
    if (!has_position()) return;
    fix_.latitude_deg = *latitude_;
    fix_.longitude_deg = *longitude_;
  }

  // GPS(149.0251,-20.2533,16): longitude, latitude, satellites. GPS(36.6146,-6.1120,0.0M) of the
  // Matrice 300: latitude, longitude, altitude.
  void ReadGps() {
    const std::optional<std::string_view> arguments = ArgumentsOf(text_, "GPS");
    if (!arguments) return;
    std::vector<std::string> parts;
    for (const std::string_view part : SplitAtCommas(*arguments)) parts.emplace_back(part);
    const bool has_decimal_commas =
        parts.size() >= 4 && arguments->find('.') == std::string_view::npos;
    if (has_decimal_commas) {  // "149,0251,-20,2533,16"
      parts = {parts[0] + "." + parts[1], parts[2] + "." + parts[3]};
    }
    if (parts.size() < 2) {
      is_unreadable_ = true;
      return;
    }
    const bool has_altitude =
        parts.size() > 2 && (parts[2].ends_with('M') || parts[2].ends_with('m'));
    ReadCoordinate(parts[0], ParseDecimal(parts[0]), has_altitude ? latitude_ : longitude_);
    ReadCoordinate(parts[1], ParseDecimal(parts[1]), has_altitude ? longitude_ : latitude_);
    // Written 0 where the altitude is not known.
    if (has_altitude && ParseLeadingDecimal(parts[2]).value_or(0) != 0) {
      fix_.altitude_m = ParseLeadingDecimal(parts[2]);
    }
    SetPosition();
  }

  // "BAROMETER:1.9", "Hb:1.9", ", H 200.70m,": above the place of take-off.
  void ReadHeights() {
    for (const std::string_view label : {"BAROMETER:", "Hb:", ", H "}) {
      const std::size_t at = text_.find(label);
      if (at == std::string_view::npos) continue;
      if (const auto height = ParseLeadingDecimal(text_.substr(at + label.size()))) {
        fix_.height_m = height;
      }
    }
  }

  // G.PRY (-27.3°, 0.0°, -76.0°): pitch, roll, yaw.
  void ReadGimbal() {
    if (const std::optional<std::string_view> arguments = ArgumentsOf(text_, "G.PRY")) {
      const std::vector<std::string_view> parts = SplitAtCommas(*arguments);
      if (parts.size() == 3) {
        pitch_ = ParseLeadingDecimal(parts[0]);
        roll_ = ParseLeadingDecimal(parts[1]);
        yaw_ = ParseLeadingDecimal(parts[2]);
      }
    }
    if (yaw_ && pitch_ && roll_) fix_.gimbal = GimbalAngles{*yaw_, *pitch_, *roll_};
  }

  std::string_view text_;
  PositionFix fix_;
  std::optional<double> latitude_, longitude_, yaw_, pitch_, roll_;
  int num_decimals_ = 0;
  bool is_unreadable_ = false;
};

// The date and time of day anywhere in the subtitle.
std::optional<double> UnixTimeOf(std::string_view text) {
  const std::vector<std::string_view> words = Words(text);
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string both = std::string(words[i]) + " " + std::string(words[i + 1]);
    if (const std::optional<double> time_s = ParseDateTime(both)) return time_s;
  }
  return std::nullopt;
}

bool HasOpenEnd(std::string_view text) {
  return text.rfind('[') != std::string_view::npos &&
         text.find(']', text.rfind('[')) == std::string_view::npos;
}

// Of a video, whose subtitles have no lines, the time.
std::string WhichSubtitle(const Subtitle& subtitle) {
  if (subtitle.line > 0 || !subtitle.begin_s) return {};
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "the subtitle at %.2f s: ", *subtitle.begin_s);
  return text.data();
}

PositionTrack TrackOf(const std::string& source, const std::vector<Subtitle>& subtitles) {
  // Of the first subtitles of the Mavic 2 there are some without a time.
  const bool has_video_times = std::ranges::any_of(
      subtitles, [](const Subtitle& subtitle) { return subtitle.begin_s.has_value(); });
  PositionTrackBuilder builder(source, "DJI telemetry", PositionClock::kVideo);
  std::optional<double> first_unix_s;
  for (const Subtitle& subtitle : subtitles) {
    const DjiEntry entry(subtitle);
    std::optional<double> time_s = subtitle.begin_s;
    if (!has_video_times) {  // the first one is at the beginning of the video
      time_s = UnixTimeOf(subtitle.text);
      if (time_s && !first_unix_s) first_unix_s = time_s;
      if (time_s) *time_s -= *first_unix_s;
    }
    if (entry.is_unreadable() || (!entry.has_position() && HasOpenEnd(subtitle.text))) {
      builder.AddUnreadable(subtitle.line,
                            WhichSubtitle(subtitle) + "the position is cut off or no number");
    } else if (!entry.has_position()) {
      builder.AddWithoutPosition(subtitle.line);
    } else if (!time_s) {
      builder.AddUnreadable(subtitle.line, "the time is missing");
    } else {
      PositionFix fix = entry.fix();
      fix.time_s = *time_s;
      builder.Add(fix, entry.num_decimals());
    }
  }
  return builder.Finish();
}

}  // namespace

bool IsSubtitleFile(const std::vector<std::string>& lines) {
  const auto first = std::ranges::find_if(
      lines, [](const std::string& line) { return !TrimBlanks(line).empty(); });
  if (first == lines.end() || !IsNumberLine(*first)) return false;
  // A number alone is the beginning of subtitles that were cut off.
  const auto second = std::next(first);
  return second == lines.end() || TrimBlanks(*second).empty() ||
         second->find(kArrow) != std::string::npos || UnixTimeOf(*second).has_value();
}

PositionTrack ParseDjiTelemetry(const std::filesystem::path& path,
                                const std::vector<std::string>& lines) {
  return TrackOf(path.string(), SplitSubtitles(lines));
}

PositionTrack ParseDjiTelemetry(const std::filesystem::path& video,
                                const std::vector<VideoSubtitle>& subtitles) {
  std::vector<Subtitle> entries;
  for (const VideoSubtitle& subtitle : subtitles) {
    std::string text = subtitle.text;
    std::ranges::replace(text, '\n', ' ');
    entries.push_back({0, subtitle.begin_s, std::move(text)});
  }
  return TrackOf(video.string(), entries);
}

}  // namespace mono3d
