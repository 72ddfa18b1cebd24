// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/error.h"

#include "mono3d/core/printable.h"

namespace mono3d {
namespace {

// What a file says may be of any length, and is shown in part.
constexpr std::size_t kMaxQuotedBytes = 200;
constexpr std::size_t kMaxLineBytes = 4000;

std::string CutTo(std::size_t max_bytes, const std::string& text) {
  if (text.size() <= max_bytes) return text;
  std::size_t end = max_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80) --end;  // UTF-8
  return text.substr(0, end) + "... (" + std::to_string(text.size()) + " bytes)";
}

std::string FormatLine(const ErrorParts& parts) {
  std::string line = parts.where.empty() ? parts.what : parts.where + ": " + parts.what;
  const bool has_expected = !parts.expected.empty();
  const bool has_found = !parts.found.empty();
  if (has_expected || has_found) {
    line += " (";
    if (has_expected) line += "expected " + parts.expected;
    if (has_expected && has_found) line += ", ";
    if (has_found) line += "found " + CutTo(kMaxQuotedBytes, parts.found);
    line += ")";
  }
  return Printable(CutTo(kMaxLineBytes, line));
}

}  // namespace

std::string Printable(std::string_view text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string printable;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F control terminals as well; in UTF-8 they begin with 0xC2.
    const bool is_c1 =
        byte == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if (byte == '\n' || byte == '\r' || byte == '\t') {
      printable += ' ';
    } else if (byte < 0x20 || byte == 0x7F || is_c1) {
      printable += {'\\', 'x', kHex[byte >> 4U], kHex[byte & 0xFU]};
    } else {
      printable += text[i];
    }
  }
  return printable;
}

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
