// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include "mono3d/core/error.h"

namespace mono3d {

// Throws the Error (kIo) of a failed call of the operating system; `code` is its errno.
[[noreturn]] inline void ThrowSystemError(const std::string& what,
                                          const std::filesystem::path& path, int code) {
  throw Error(ErrorParts{.what = what + ": " + std::generic_category().message(code),
                         .where = path,
                         .expected = {},
                         .found = {},
                         .code = ErrorCode::kIo});
}

}  // namespace mono3d
