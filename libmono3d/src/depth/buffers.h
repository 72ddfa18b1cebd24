// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "gpu/buffer.h"

namespace mono3d {

// Makes the buffer at least `size_bytes` large; what it held is lost when it has to grow.
inline void Reserve(Buffer& buffer, const std::shared_ptr<Device>& device, std::size_t size_bytes,
                    std::string name) {
  if (buffer.size_bytes() >= size_bytes) return;
  buffer = Buffer();  // gives the old memory back first
  buffer = Buffer(device, size_bytes, std::move(name));
}

}  // namespace mono3d
