// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "core/large_memory.h"
#include "gpu/device_internals.h"

namespace mono3d {

// What a Buffer owns. Members in the order in which they need each other.
struct BufferMemory {
  std::shared_ptr<Device> device;
  std::string name;
  std::size_t size_bytes = 0;       // as asked for
  std::size_t allocated_bytes = 0;  // rounded up to kBufferGranularityBytes
  LargeMemory host;                 // what `memory` is, where the device is a processor
  vk::raii::DeviceMemory memory = nullptr;
  vk::raii::Buffer buffer = nullptr;
  std::byte* mapped = nullptr;  // null where the host cannot see it
  std::map<vk::Format, vk::raii::BufferView> views;
};

// The largest texel and the widest store of a shader (uvec4): the last, partly filled one is whole.
constexpr std::size_t kBufferGranularityBytes = 16;

// The view of the whole buffer in `format`, made at the first call. Throws Error when it has more
// texels than the device can address.
vk::BufferView TexelView(BufferMemory& memory, vk::Format format, std::size_t texel_bytes);

}  // namespace mono3d
