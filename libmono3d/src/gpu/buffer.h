// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "mono3d/gpu/device.h"

namespace mono3d {

struct BufferMemory;  // the Vulkan side, gpu/buffer_memory.h

// Memory of a device that kernels read and write: as storage buffer or as texel buffer, whatever
// the kernel declares. Device-local; where the host cannot see it, transfers go through staging
// memory. Upload and Download act at once, not in the order of a Recorder: a Recorder sees what was
// uploaded before its Submit, and what it wrote can be downloaded after. One thread at a time.
//
// A kernel sees the size rounded up to 16 bytes, so the last uvec4 or vec4 can be read and written
// whole; array.length() counts that padding.
class Buffer {
 public:
  Buffer() = default;  // empty: size 0, cannot be bound

  // Contents undefined. `name` is what errors and debuggers call it: "depth/census". Throws Error
  // for size 0, above Limits().max_storage_buffer_bytes, and when memory runs out.
  Buffer(std::shared_ptr<Device> device, std::size_t size_bytes, std::string name);

  Buffer(Buffer&&) noexcept = default;
  Buffer& operator=(Buffer&&) noexcept = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  std::size_t size_bytes() const;
  const std::string& name() const;

  // Both throw Error when the range leaves the buffer.
  template <typename T>
  void Upload(std::span<const T> data, std::size_t offset_bytes = 0) {
    static_assert(std::is_trivially_copyable_v<T>);
    UploadBytes(data.data(), data.size_bytes(), offset_bytes);
  }
  template <typename T>
  void Download(std::span<T> data, std::size_t offset_bytes = 0) const {
    static_assert(std::is_trivially_copyable_v<T>);
    DownloadBytes(data.data(), data.size_bytes(), offset_bytes);
  }
  // All of it, rounded down to whole elements.
  template <typename T>
  std::vector<T> Download() const {
    std::vector<T> data(size_bytes() / sizeof(T));
    Download(std::span<T>(data));
    return data;
  }
  // All of it, rounded down to whole elements, without a copy where the host sees the memory; else
  // a copy in `copy`. Holds until the memory is written again.
  template <typename T>
  std::span<const T> Read(std::vector<T>& copy) const {
    static_assert(std::is_trivially_copyable_v<T>);
    if (const std::byte* const memory = mapped()) {
      return {reinterpret_cast<const T*>(memory), size_bytes() / sizeof(T)};
    }
    copy.resize(size_bytes() / sizeof(T));
    Download(std::span<T>(copy));
    return copy;
  }
  // The other way round: where the host writes what is to be in the buffer, the memory itself where
  // it sees it, else `copy`. EndWrite, with the same copy, makes it so. What is not written stays,
  // in the buffer or in `copy`.
  template <typename T>
  std::span<T> BeginWrite(std::vector<T>& copy) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (std::byte* const memory = mapped()) {
      return {reinterpret_cast<T*>(memory), size_bytes() / sizeof(T)};
    }
    copy.resize(size_bytes() / sizeof(T));
    return copy;
  }
  template <typename T>
  void EndWrite(const std::vector<T>& copy) {
    if (mapped() == nullptr) Upload(std::span<const T>(copy));
  }

 private:
  friend class Recorder;

  std::byte* mapped() const;  // null where the host cannot see it

  void UploadBytes(const void* data, std::size_t size_bytes, std::size_t offset_bytes);
  void DownloadBytes(void* data, std::size_t size_bytes, std::size_t offset_bytes) const;

  std::shared_ptr<BufferMemory> memory_;
};

}  // namespace mono3d
