// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <utility>

namespace mono3d {

// Memory of some megabytes from the system itself, on large pages (2 MB) where it has them: volumes
// that are read along rows and columns otherwise wait for the translation of addresses, on virtual
// machines for longer than for the memory. All 0 at first, and given back at the end. Any thread.
class LargeMemory {
 public:
  LargeMemory() = default;
  // Empty where there is none. At an address, and of a size, that are multiples of the system's
  // pages.
  explicit LargeMemory(std::size_t num_bytes);
  LargeMemory(LargeMemory&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  LargeMemory& operator=(LargeMemory&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  LargeMemory(const LargeMemory&) = delete;
  LargeMemory& operator=(const LargeMemory&) = delete;
  ~LargeMemory();

  std::byte* data() const { return static_cast<std::byte*>(data_); }
  std::size_t size() const { return size_; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace mono3d
