// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mono3d {

// All bytes of a file. Throws Error when it cannot be read.
std::string ReadBytes(const std::filesystem::path& path);

// The lines of a text file, without line ends (of any system) and byte-order mark.
std::vector<std::string> ReadLines(const std::filesystem::path& path);

// "file:12", for messages; lines count from 1.
std::string AtLine(const std::filesystem::path& path, std::size_t line_number);

// The words of a line, between blanks.
std::vector<std::string_view> Words(std::string_view line);

// The whole of `text` as a number, whatever the locale; nothing when it is anything else. Infinity
// and "nan" are nothing as well.
std::optional<double> ParseNumber(std::string_view text);
std::optional<std::int64_t> ParseInteger(std::string_view text);

// The shortest text that reads back as the same number.
std::string ToText(double number);

}  // namespace mono3d
