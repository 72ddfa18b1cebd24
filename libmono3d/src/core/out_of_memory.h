// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <new>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {

// Runs `step`. Where the memory of the host ends in it, throws an Error that says so of `where`.
template <typename Step>
auto NamingOutOfMemory(const std::string& where, const Step& step) {
  try {
    return step();
  } catch (const std::bad_alloc&) {
    throw Error(
        ErrorParts{"not enough memory on this machine", where, {}, {}, ErrorCode::kOutOfMemory});
  }
}

}  // namespace mono3d
