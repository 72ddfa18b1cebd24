// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/large_memory.h"

#include <sys/mman.h>
#include <unistd.h>

namespace mono3d {

LargeMemory::LargeMemory(std::size_t num_bytes) {
  const auto page_bytes = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t size = (num_bytes + page_bytes - 1) / page_bytes * page_bytes;
  void* const data =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (data == MAP_FAILED) return;
  data_ = data;
  size_ = size;
#if defined(MADV_HUGEPAGE)
  // Where it fails, pages are small.
  madvise(data, size, MADV_HUGEPAGE);
#endif
}

LargeMemory::~LargeMemory() {
  if (data_ != nullptr) munmap(data_, size_);
}

}  // namespace mono3d
