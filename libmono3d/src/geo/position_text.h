// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/geo/position_track.h"

namespace mono3d {

std::string_view TrimBlanks(std::string_view text);

// Without regard to the case of ASCII letters.
bool EqualsIgnoringCase(std::string_view a, std::string_view b);

// A number with a point or, as some languages write it, a comma: "41.42", "41,42", "+3".
std::optional<double> ParseDecimal(std::string_view text);

// The number that `text` begins with: 200.7 of "200.70m"; nothing of "n/a".
std::optional<double> ParseLeadingDecimal(std::string_view text);

// Digits behind the point (or comma) of a number.
int CountDecimals(std::string_view number);

// Seconds since 1970 of a date and time of day: "2022-05-01 15:01:58,531,716", "2017.8.5 14:11:51",
// "2022-05-01T15:01:58.25+02:00", "2022/05/01 15:01:58Z". Without a zone: as if in UTC.
std::optional<double> ParseDateTime(std::string_view text);

// "00:15:04,904" in seconds.
std::optional<double> ParseTimeOfDay(std::string_view text);

// Puts together a track out of the entries of a file.
class PositionTrackBuilder {
 public:
  PositionTrackBuilder(std::string source, std::string form, PositionClock clock);

  // Latitude and longitude within range and not both 0 are a position. Of PositionClock::kImages a
  // time of 0 is one that is not told. `num_decimals`: of latitude or longitude as written,
  // whichever has more; -1: not written as text.
  void Add(const PositionFix& fix, int num_decimals);
  void AddWithoutPosition(std::size_t line);  // 0: not a text file
  void AddUnreadable(std::size_t line, const std::string& why);

  // In order, without repetitions; throws Error, with the line that stands in the way, where there
  // is no position.
  PositionTrack Finish();

 private:
  void SettleImageTimes();
  void SortByTime();
  void DropRepeated();

  // An entry that has no position, and why.
  struct Passed {
    std::size_t line = 0;
    std::string why;
  };

  PositionTrack track_;
  std::optional<Passed> first_unreadable_;
  std::optional<Passed> first_without_position_;
  int num_decimals_ = -1;
};

}  // namespace mono3d
