// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

// For functions of host kernels. Not for a whole file: what headers define inline must run on any
// processor. Without FMA, so that results are those of separate operations, as the shaders' are.
#if defined(__x86_64__)
#define MONO3D_AVX2 [[gnu::target("avx2,popcnt,no-fma,no-fma4")]]
#define MONO3D_HAS_AVX2 1
#else
#define MONO3D_HAS_AVX2 0
#endif

namespace mono3d {

// What one dispatch gives to a host kernel. Memory of buffers is aligned to 16 bytes, and its size
// rounded up to as much.
struct HostDispatch {
  std::span<const std::uint32_t> constants;  // specialisation, as far as given
  std::span<const std::byte> push;           // push constants
  std::span<std::byte* const> buffers;       // in the order of the bindings
  std::uint32_t num_workgroups = 0;          // in all

  template <typename Push>
  Push PushAs() const {
    static_assert(std::is_trivially_copyable_v<Push>);
    Push result;
    std::memcpy(&result, push.data(), sizeof(Push));
    return result;
  }
  // Shaders use the storage as arrays of words, floats or vectors of these.
  template <typename T>
  T* BufferAs(std::size_t binding) const {
    return reinterpret_cast<T*>(buffers[binding]);
  }
};

// A kernel as compiled code: does share `part` of `num_parts` of a dispatch, all of which together
// write what the shader writes. Called by several threads at once, each with shares of its own.
// A device that computes on the processor runs it in place of what its driver makes of the shader.
using HostKernel = void (*)(const HostDispatch& dispatch, std::uint32_t part,
                            std::uint32_t num_parts);

// Items first <= i < end of share `part` of `num_items`, in whole groups of `group`.
struct HostShare {
  std::uint32_t first, end;
};
inline HostShare ShareOf(std::uint32_t num_items, std::uint32_t group, std::uint32_t part,
                         std::uint32_t num_parts) {
  const std::uint64_t num_groups = (std::uint64_t{num_items} + group - 1) / group;
  const std::uint64_t first = num_groups * part / num_parts * group;
  const std::uint64_t end = num_groups * (part + 1) / num_parts * group;
  return {static_cast<std::uint32_t>(first < num_items ? first : num_items),
          static_cast<std::uint32_t>(end < num_items ? end : num_items)};
}

}  // namespace mono3d
