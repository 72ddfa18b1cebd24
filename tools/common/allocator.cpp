// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/allocator.h"

#include <cstdlib>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace mono3d::tools {

void ReturnLargeBlocks() {
#if defined(__GLIBC__)
  constexpr int kBlockBytes = 8 << 20;
  constexpr int kTopBytes = 16 << 20;
  // What is set in the environment holds.
  if (std::getenv("MALLOC_MMAP_THRESHOLD_") == nullptr) mallopt(M_MMAP_THRESHOLD, kBlockBytes);
  if (std::getenv("MALLOC_TRIM_THRESHOLD_") == nullptr) mallopt(M_TRIM_THRESHOLD, kTopBytes);
#endif
}

}  // namespace mono3d::tools
