// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <span>
#include <type_traits>

#include "gpu/buffer.h"
#include "gpu/kernel.h"
#include "mono3d/core/timing.h"
#include "mono3d/gpu/device.h"

namespace mono3d {

// Workgroups for `items`: ceil(items / per_group). Throws Error when that exceeds 32 bits.
std::uint32_t DivideRoundingUp(std::uint64_t items, std::uint64_t per_group);

using BufferRefs = std::initializer_list<std::reference_wrapper<const Buffer>>;

// Many steps, one submission. Each step sees all that the steps before it wrote. Keep one for the
// life of a stage module: what it needs from Vulkan is made once. Kernels and buffers that were
// recorded are kept alive until Submit. One thread at a time; several recorders may share a device.
//
// A step that throws records nothing; earlier steps stay recorded.
class Recorder {
 public:
  explicit Recorder(std::shared_ptr<Device> device);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  // One dispatch. `buffers` in the order of the shader's bindings 0..n-1. A binding may be a std430
  // buffer or a `[u]imageBuffer`; which one is read from the shader. `push` is the struct of the
  // stage's .params.h. Throws Error for a wrong number of buffers, a wrong size of `push`, an empty
  // buffer, one too large for a texel view, and for more workgroups than the device takes.
  // No workgroups at all (an empty grid) is no error and does nothing.
  template <typename Push>
  void Dispatch(const Kernel& kernel, BufferRefs buffers, const Push& push,
                std::array<std::uint32_t, 3> num_workgroups) {
    static_assert(std::is_trivially_copyable_v<Push> && sizeof(Push) % 4 == 0);
    DispatchBytes(kernel, {buffers.begin(), buffers.size()}, &push, sizeof(Push), num_workgroups);
  }
  // The same for a shader without push constants.
  void Dispatch(const Kernel& kernel, BufferRefs buffers,
                std::array<std::uint32_t, 3> num_workgroups) {
    DispatchBytes(kernel, {buffers.begin(), buffers.size()}, nullptr, 0, num_workgroups);
  }

  // Every 32-bit word of the buffer = value. Throws Error for an empty buffer.
  void Fill(const Buffer& buffer, std::uint32_t value);

  // Throws Error when a range leaves its buffer, or the two overlap in one buffer.
  void Copy(const Buffer& from, std::size_t from_offset_bytes, const Buffer& to,
            std::size_t to_offset_bytes, std::size_t size_bytes);

  // Runs everything recorded since the last Submit and waits for it. Adds the GPU time of each
  // kernel name to `times`, one call per Submit ("gpu/fill" and "gpu/copy" for the other two);
  // 0 ms where the device has no timestamps. Throws Error when the device is lost.
  void Submit(StageTimes* times = nullptr);

 private:
  using BufferSpan = std::span<const std::reference_wrapper<const Buffer>>;

  void DispatchBytes(const Kernel& kernel, BufferSpan buffers, const void* push,
                     std::size_t push_bytes, std::array<std::uint32_t, 3> num_workgroups);

  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace mono3d
