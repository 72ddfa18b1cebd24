// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <stdexcept>
#include <string>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// The kind of an error, for callers that act on it. The message says the rest.
enum class ErrorCode {
  kInvalidArgument,  // an option or an argument of a call: the caller must change it
  kInvalidInput,     // the content of a file, an image, a pose or a calibration
  kNotFound,         // a file, a folder or an image that is not there
  kUnsupported,      // valid, but not handled: a camera model, a file form, a limit of the device
  kIo,               // the system cannot read or write: no permission, disk full
  kDevice,           // no Vulkan device, or its driver failed
  kOutOfMemory,      // of the host or of the device
};

// "invalid argument", "out of memory", ...
const char* ToString(ErrorCode code);

// What an error message says. Empty parts are left out.
struct ErrorParts {
  std::string what;      // what went wrong: "image has another size than the calibration"
  std::string where;     // file, file:line, image, device
  std::string expected;  // "768x448"
  std::string found;     // "640x480"
  ErrorCode code = ErrorCode::kInvalidInput;
};

// A broken contract or environment: unreadable input, no Vulkan device, full disk.
// what() is one line: "where: what (expected ..., found ...)".
class Error : public std::runtime_error {
 public:
  explicit Error(const ErrorParts& parts);
  explicit Error(const std::string& what, ErrorCode code = ErrorCode::kInvalidInput);

  ErrorCode code() const noexcept { return code_; }

 private:
  ErrorCode code_;
};

// A wrong option or argument: kInvalidArgument, whatever the parts say. Tools exit with 2.
class UsageError : public Error {
 public:
  explicit UsageError(const ErrorParts& parts);
  explicit UsageError(const std::string& what);
};

}  // namespace mono3d
