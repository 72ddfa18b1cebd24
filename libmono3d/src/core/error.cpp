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

const char* ToString(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return "invalid argument";
    case ErrorCode::kInvalidInput:
      return "invalid input";
    case ErrorCode::kNotFound:
      return "not found";
    case ErrorCode::kUnsupported:
      return "unsupported";
    case ErrorCode::kIo:
      return "input or output failed";
    case ErrorCode::kDevice:
      return "device failed";
    case ErrorCode::kOutOfMemory:
      return "out of memory";
  }
  return "unknown error";
}

Error::Error(const ErrorParts& parts) : std::runtime_error(FormatLine(parts)), code_(parts.code) {}

Error::Error(const std::string& what, ErrorCode code)
    : Error(ErrorParts{.what = what, .where = {}, .expected = {}, .found = {}, .code = code}) {}

UsageError::UsageError(const ErrorParts& parts)
    : Error(ErrorParts{.what = parts.what,
                       .where = parts.where,
                       .expected = parts.expected,
                       .found = parts.found,
                       .code = ErrorCode::kInvalidArgument}) {}

UsageError::UsageError(const std::string& what) : Error(what, ErrorCode::kInvalidArgument) {}

}  // namespace mono3d
