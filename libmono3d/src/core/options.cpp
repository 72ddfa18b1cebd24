// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/options.h"

#include <algorithm>
#include <sstream>

#include "mono3d/core/error.h"

namespace mono3d {

void RequireOption(bool holds, std::string_view option, std::string_view expected, double found) {
  if (holds) return;
  std::ostringstream text;
  text << found;
  throw UsageError(ErrorParts{.what = "option out of range",
                              .where = "--" + std::string(option),
                              .expected = std::string(expected),
                              .found = text.str()});
}

std::optional<std::string> WordOf(const OptionField& option) {
  const int* const* value = std::get_if<int*>(&option.value);
  if (value == nullptr) return std::nullopt;
  const auto word = std::ranges::find(option.words, **value, &OptionWord::value);
  return word == option.words.end() ? std::nullopt : std::optional(word->word);
}

}  // namespace mono3d
