// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::string FormatLine(const ErrorParts& parts) {
  std::string line = parts.where.empty() ? parts.what : parts.where + ": " + parts.what;
  const bool has_expected = !parts.expected.empty();
  const bool has_found = !parts.found.empty();
  if (has_expected || has_found) {
    line += " (";
    if (has_expected) line += "expected " + parts.expected;
    if (has_expected && has_found) line += ", ";
    if (has_found) line += "found " + parts.found;
    line += ")";
  }
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return line;
}

}  // namespace

Error::Error(const ErrorParts& parts) : std::runtime_error(FormatLine(parts)) {}

}  // namespace mono3d
