// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/address_space.h"

#include <sys/mman.h>
#include <sys/resource.h>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::string Megabytes(std::size_t num_bytes) { return std::to_string(num_bytes >> 20U) + " MB"; }

}  // namespace

void RequireAddressSpace(const std::string& where, std::size_t num_bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  void* memory =
      mmap(nullptr, num_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory != MAP_FAILED) {
    munmap(memory, num_bytes);
    return;
  }
  throw Error(ErrorParts{
      .what = "not enough memory for the Vulkan driver: this process is limited to " +
              Megabytes(limit.rlim_cur) + " (ulimit -v); raise the limit to 2 GB or more",
      .where = where,
      .expected = Megabytes(num_bytes) + " that are free",
      .found = {},
      .code = ErrorCode::kOutOfMemory});
}

}  // namespace mono3d
