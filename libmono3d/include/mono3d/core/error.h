// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <stdexcept>
#include <string>

namespace mono3d {

// What an error message says. Empty parts are left out.
struct ErrorParts {
  std::string what;      // what went wrong: "image has another size than the calibration"
  std::string where;     // file, file:line, image, device
  std::string expected;  // "768x448"
  std::string found;     // "640x480"
};

// A broken contract or environment: unreadable input, no Vulkan device, full disk.
// what() is one line: "where: what (expected ..., found ...)".
class Error : public std::runtime_error {
 public:
  explicit Error(const ErrorParts& parts);
  explicit Error(const std::string& what) : Error(ErrorParts{what, {}, {}, {}}) {}
};

// A wrong option or argument: the caller's words are off, not the data. Tools exit with 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

}  // namespace mono3d
