// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace mono3d::tools {

// Of an option whose value is one of these words: takes the word's value in place of it.
template <typename Value>
CLI::Validator OneOf(std::vector<std::pair<std::string, Value>> values) {
  std::string words;
  for (std::size_t i = 0; i < values.size(); ++i) {
    words += (i == 0 ? "" : i + 1 < values.size() ? ", " : " or ") + values[i].first;
  }
  return CLI::Validator(
      [values = std::move(values), words](std::string& text) {
        for (const auto& [word, value] : values) {
          if (text != word) continue;
          text = std::to_string(static_cast<int>(value));
          return std::string();
        }
        return "expected " + words + ", found " + text;
      },
      "");
}

}  // namespace mono3d::tools
