// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/timestamps_file.h"

#include <optional>
#include <string>
#include <string_view>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {

std::vector<double> ReadTimestamps(const std::filesystem::path& path) {
  const std::vector<std::string> lines = ReadLines(path);
  std::vector<double> timestamps_s;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::optional<double> time_s = words.size() == 1 ? ParseNumber(words[0]) : std::nullopt;
    if (!time_s || (!timestamps_s.empty() && *time_s <= timestamps_s.back())) {
      throw Error(ErrorParts{.what = "bad timestamp",
                             .where = AtLine(path, i + 1),
                             .expected = "one number of seconds, larger than the one before",
                             .found = lines[i]});
    }
    timestamps_s.push_back(*time_s);
  }
  return timestamps_s;
}

}  // namespace mono3d
