// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_text.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <utility>

#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/core/printable.h"

namespace mono3d {
namespace {

constexpr std::string_view kTextBlanks = " \t\r\n\v\f";

char LowerCase(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// Takes the whole number at the front of `text`, with at most `max_digits`.
std::optional<int> TakeWhole(std::string_view& text, std::size_t max_digits) {
  std::size_t length = 0;
  while (length < text.size() && length < max_digits && IsDigit(text[length])) ++length;
  if (length == 0) return std::nullopt;
  const std::optional<std::int64_t> number = ParseInteger(text.substr(0, length));
  text.remove_prefix(length);
  return number ? std::optional<int>(static_cast<int>(*number)) : std::nullopt;
}

bool TakeOneOf(std::string_view& text, std::string_view characters) {
  if (text.empty() || characters.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

// Takes "15:01:58", "15:01:58.25", "15:01:58,531,716" (milli- and microseconds).
std::optional<double> TakeTimeOfDay(std::string_view& text) {
  const std::optional<int> hours = TakeWhole(text, 3);
  if (!hours || !TakeOneOf(text, ":")) return std::nullopt;
  const std::optional<int> minutes = TakeWhole(text, 2);
  if (!minutes || *minutes > 59 || !TakeOneOf(text, ":")) return std::nullopt;
  const std::optional<int> seconds = TakeWhole(text, 2);
  if (!seconds || *seconds > 60) return std::nullopt;
  double time_s = *hours * 3600.0 + *minutes * 60.0 + *seconds;
  double unit = 1;
  const bool is_in_groups = text.starts_with(',');
  while (text.size() > 1 && (text[0] == '.' || text[0] == ',') && IsDigit(text[1])) {
    text.remove_prefix(1);
    while (!text.empty() && IsDigit(text.front())) {
      unit /= 10;
      if (unit > 1e-10) time_s += unit * (text.front() - '0');
      text.remove_prefix(1);
    }
    if (!is_in_groups) break;
  }
  return time_s;
}

// Metres on the ground of one degree of latitude.
constexpr double kMetresPerDegree = 111'320;

}  // namespace

std::string_view TrimBlanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kTextBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kTextBlanks) - first + 1);
}

bool EqualsIgnoringCase(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, LowerCase, LowerCase);
}

std::optional<double> ParseDecimal(std::string_view text) {
  text = TrimBlanks(text);
  if (std::ranges::count(text, ',') != 1 || text.find('.') != std::string_view::npos) {
    return ParseNumber(text);
  }
  std::string with_point(text);
  std::ranges::replace(with_point, ',', '.');
  return ParseNumber(with_point);
}

std::optional<double> ParseLeadingDecimal(std::string_view text) {
  text = TrimBlanks(text);
  std::size_t length = 0;
  if (length < text.size() && (text[length] == '+' || text[length] == '-')) ++length;
  while (length < text.size() &&
         (IsDigit(text[length]) || text[length] == '.' ||
          (text[length] == ',' && length + 1 < text.size() && IsDigit(text[length + 1])))) {
    ++length;
  }
  return ParseDecimal(text.substr(0, length));
}

int CountDecimals(std::string_view number) {
  const std::size_t point = number.find_first_of(".,");
  if (point == std::string_view::npos) return 0;
  int count = 0;
  for (std::size_t i = point + 1; i < number.size() && IsDigit(number[i]); ++i) ++count;
  return count;
}

std::optional<double> ParseTimeOfDay(std::string_view text) {
  text = TrimBlanks(text);
  const std::optional<double> time_s = TakeTimeOfDay(text);
  return text.empty() ? time_s : std::nullopt;
}

std::optional<double> ParseDateTime(std::string_view text) {
  constexpr std::string_view kDateMarks = "-./:";
  text = TrimBlanks(text);
  const std::optional<int> year = TakeWhole(text, 4);
  if (!year || *year < 1970 || !TakeOneOf(text, kDateMarks)) return std::nullopt;
  const std::optional<int> month = TakeWhole(text, 2);
  if (!month || !TakeOneOf(text, kDateMarks)) return std::nullopt;
  const std::optional<int> day = TakeWhole(text, 2);
  if (!day || !TakeOneOf(text, " T")) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok()) return std::nullopt;
  text = TrimBlanks(text);
  const std::optional<double> time_s = TakeTimeOfDay(text);
  if (!time_s) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  double unix_s = static_cast<double>(days) * 86'400.0 + *time_s;
  text = TrimBlanks(text);
  if (text.empty() || EqualsIgnoringCase(text, "z")) return unix_s;
  const double sign = text.front() == '-' ? -1 : 1;
  if (!TakeOneOf(text, "+-")) return std::nullopt;
  const std::optional<int> zone_hours = TakeWhole(text, 2);
  if (!zone_hours) return std::nullopt;
  TakeOneOf(text, ":");
  const int zone_minutes = TakeWhole(text, 2).value_or(0);
  unix_s -= sign * (*zone_hours * 3600.0 + zone_minutes * 60.0);
  return text.empty() ? std::optional(unix_s) : std::nullopt;
}

PositionTrackBuilder::PositionTrackBuilder(std::string source, std::string form,
                                           PositionClock clock) {
  track_.source = std::move(source);
  track_.form = std::move(form);
  track_.clock = clock;
}

void PositionTrackBuilder::Add(const PositionFix& fix, int num_decimals) {
  const bool is_in_range = std::abs(fix.latitude_deg) <= 90 && std::abs(fix.longitude_deg) <= 180;
  if (!is_in_range) {
    const bool is_turned = std::abs(fix.longitude_deg) <= 90 && std::abs(fix.latitude_deg) <= 180;
    AddUnreadable(fix.line, "latitude " + ToText(fix.latitude_deg) + " and longitude " +
                                ToText(fix.longitude_deg) + " are no place" +
                                (is_turned ? ": are the two exchanged?" : ""));
    return;
  }
  if (fix.latitude_deg == 0 && fix.longitude_deg == 0) {
    AddWithoutPosition(fix.line);
    return;
  }
  ++track_.num_entries;
  num_decimals_ = std::max(num_decimals_, num_decimals);
  track_.fixes.push_back(fix);
}

void PositionTrackBuilder::AddWithoutPosition(std::size_t line) {
  ++track_.num_entries;
  ++track_.num_without_position;
  if (!first_without_position_) {
    first_without_position_ = {line, "the first has no latitude and longitude, or 0 and 0"};
  }
}

void PositionTrackBuilder::AddUnreadable(std::size_t line, const std::string& why) {
  ++track_.num_entries;
  if (++track_.num_unreadable > 1) return;
  first_unreadable_ = {line, why};
  track_.first_unreadable = line > 0 ? "line " + std::to_string(line) + ": " + why : why;
}

// Times of some images alone say nothing of the order of all.
void PositionTrackBuilder::SettleImageTimes() {
  if (track_.clock != PositionClock::kImages) return;
  track_.has_image_times =
      std::ranges::all_of(track_.fixes, [](const PositionFix& fix) { return fix.time_s != 0; });
  if (track_.has_image_times) return;
  for (PositionFix& fix : track_.fixes) fix.time_s = 0;
}

void PositionTrackBuilder::SortByTime() {
  if (track_.clock == PositionClock::kImages) return;
  std::ranges::stable_sort(track_.fixes, {}, &PositionFix::time_s);
}

// Telemetry is written at the rate of the frames; receivers measure once to ten times a second. A
// receiver at rest repeats itself as well: one a second is kept.
void PositionTrackBuilder::DropRepeated() {
  constexpr double kLongestRepetition_s = 1;
  if (track_.clock == PositionClock::kImages) return;
  std::vector<PositionFix> kept;
  for (PositionFix& fix : track_.fixes) {
    const bool is_repeated = !kept.empty() && kept.back().latitude_deg == fix.latitude_deg &&
                             kept.back().longitude_deg == fix.longitude_deg &&
                             fix.time_s < kept.back().time_s + kLongestRepetition_s;
    const bool is_at_same_time = !kept.empty() && kept.back().time_s == fix.time_s;
    if (!is_repeated && !is_at_same_time) kept.push_back(std::move(fix));
  }
  track_.fixes = std::move(kept);
}

PositionTrack PositionTrackBuilder::Finish() {
  if (track_.fixes.empty()) {
    // What cannot be read tells more than what the receiver had no fix for.
    const Passed first = first_unreadable_         ? *first_unreadable_
                         : first_without_position_ ? *first_without_position_
                                                   : Passed{};
    std::string found =
        std::to_string(track_.num_entries) + (track_.num_entries == 1 ? " entry" : " entries");
    if (!first.why.empty()) found += ", " + first.why;
    throw Error(
        ErrorParts{.what = "no positions in this file (" + track_.form + ")",
                   .where = first.line > 0 ? AtLine(track_.source, first.line) : track_.source,
                   .expected = "entries with latitude and longitude",
                   .found = found});
  }
  SettleImageTimes();
  SortByTime();
  DropRepeated();
  if (num_decimals_ >= 0) track_.resolution_m = kMetresPerDegree * std::pow(10, -num_decimals_);
  return std::move(track_);
}

}  // namespace mono3d
