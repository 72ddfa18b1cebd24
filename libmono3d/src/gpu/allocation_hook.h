// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace mono3d {

// Called before each Buffer of this size and name is allocated; what it throws is thrown there, as
// a device without memory would have it.
using AllocationHook = std::function<void(std::size_t size_bytes, const std::string& name)>;

// For tests. Empty: none. Not while another thread makes buffers.
void SetAllocationHook(AllocationHook hook);

}  // namespace mono3d
