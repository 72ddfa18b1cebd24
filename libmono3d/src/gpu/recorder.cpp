// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/recorder.h"

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "gpu/buffer_memory.h"
#include "gpu/descriptor_pools.h"
#include "gpu/host_threads.h"
#include "gpu/kernel_pipeline.h"
#include "gpu/step_clock.h"

namespace mono3d {
namespace {

using Stage = vk::PipelineStageFlagBits;
using Access = vk::AccessFlagBits;

// Makes what earlier steps wrote, in this submission or one before, visible to the next step. One
// barrier for all memory: the stages of a depth map depend on each other anyway.
void BarrierBetweenSteps(const vk::raii::CommandBuffer& commands) {
  constexpr auto kStages = Stage::eComputeShader | Stage::eTransfer;
  constexpr auto kWrites = Access::eShaderWrite | Access::eTransferWrite;
  constexpr auto kReads = Access::eShaderRead | Access::eTransferRead;
  const vk::MemoryBarrier barrier(kWrites, kWrites | kReads);
  commands.pipelineBarrier(kStages, kStages, {}, barrier, {}, {});
}

void BarrierToHost(const vk::raii::CommandBuffer& commands) {
  const vk::MemoryBarrier barrier(Access::eShaderWrite | Access::eTransferWrite, Access::eHostRead);
  commands.pipelineBarrier(Stage::eComputeShader | Stage::eTransfer, Stage::eHost, {}, barrier, {},
                           {});
}

void CheckDispatch(const KernelPipeline& kernel, std::size_t num_buffers, std::size_t push_bytes,
                   const std::array<std::uint32_t, 3>& num_workgroups) {
  const auto require = [&](bool holds, const char* what, std::size_t expected, std::size_t found) {
    if (holds) return;
    throw Error({what, kernel.name, std::to_string(expected), std::to_string(found),
                 ErrorCode::kInvalidArgument});
  };
  const ShaderInterface& shader = kernel.interface;
  require(num_buffers == shader.bindings.size(), "wrong number of buffers", shader.bindings.size(),
          num_buffers);
  require(push_bytes == shader.push_constant_bytes, "wrong number of bytes of push constants",
          shader.push_constant_bytes, push_bytes);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t limit = kernel.device->limits().max_workgroup_count[i];
    require(num_workgroups[i] <= limit, "more workgroups than the device takes", limit,
            num_workgroups[i]);
  }
}

void CheckCopy(const BufferMemory& memory, std::size_t offset_bytes, std::size_t size_bytes) {
  if (offset_bytes <= memory.size_bytes && size_bytes <= memory.size_bytes - offset_bytes) return;
  throw Error({"the copy leaves the buffer", memory.name,
               std::to_string(memory.size_bytes) + " bytes",
               std::to_string(size_bytes) + " bytes at " + std::to_string(offset_bytes),
               ErrorCode::kInvalidArgument});
}

}  // namespace

std::uint32_t DivideRoundingUp(std::uint64_t items, std::uint64_t per_group) {
  if (per_group == 0) throw Error("workgroups of no items", ErrorCode::kInvalidArgument);
  const std::uint64_t groups = items / per_group + (items % per_group != 0 ? 1 : 0);
  if (groups > std::numeric_limits<std::uint32_t>::max()) {
    throw Error({"too many workgroups",
                 {},
                 "at most 2^32 - 1",
                 std::to_string(groups),
                 ErrorCode::kInvalidArgument});
  }
  return static_cast<std::uint32_t>(groups);
}

class Recorder::Implementation {
 public:
  explicit Implementation(std::shared_ptr<Device> device);

  // Throws Error for a buffer without memory or of another device; else keeps it until Submit.
  BufferMemory& Use(const std::shared_ptr<BufferMemory>& memory, const std::string& where);
  void Dispatch(const std::shared_ptr<const KernelPipeline>& kernel,
                const std::vector<BufferMemory*>& buffers, std::span<const std::byte> push,
                const std::array<std::uint32_t, 3>& num_workgroups);
  void Fill(const BufferMemory& buffer, std::uint32_t value);
  void Copy(const BufferMemory& from, const BufferMemory& to, const vk::BufferCopy& region);
  void Submit(StageTimes* times);

  const std::string& device_name() const { return device_->info().name; }
  void RequireOwn(const Device& device, const std::string& where) const {
    if (&device == device_.get()) return;
    throw Error({"it belongs to another device than the recorder",
                 where,
                 {},
                 {},
                 ErrorCode::kInvalidArgument});
  }

 private:
  // A dispatch that compiled code does, between the command buffers before and behind it.
  struct HostStep {
    std::size_t num_command_buffers = 0;  // that come before it
    const KernelPipeline* kernel = nullptr;
    std::vector<std::byte*> buffers;
    std::vector<std::byte> push;
    std::uint32_t num_workgroups = 0;
  };

  vk::raii::CommandBuffer& BeginStep(const std::string& name);
  void EndCommands();
  void RunHostStep(const HostStep& step);
  void RunAll();
  void Clear();

  std::shared_ptr<Device> device_;
  vk::raii::CommandPool command_pool_;
  std::vector<vk::raii::CommandBuffer> command_buffers_;  // kept from one submission to the next
  std::size_t num_command_buffers_ = 0;                   // of this one
  vk::raii::Fence fence_;
  DescriptorPools descriptors_;
  StepClock clock_;
  bool is_recording_ = false;  // to the last of them
  std::vector<HostStep> host_steps_;
  std::vector<std::shared_ptr<const void>> in_use_;  // kernels and buffers of the steps so far
};

Recorder::Implementation::Implementation(std::shared_ptr<Device> device)
    : device_(std::move(device)),
      command_pool_(device_->vulkan().createCommandPool(
          {vk::CommandPoolCreateFlagBits::eTransient, device_->queue_family()})),
      fence_(device_->vulkan().createFence({})),
      clock_(device_) {}

BufferMemory& Recorder::Implementation::Use(const std::shared_ptr<BufferMemory>& memory,
                                            const std::string& where) {
  if (!memory)
    throw Error({"an empty buffer cannot be used", where, {}, {}, ErrorCode::kInvalidArgument});
  RequireOwn(*memory->device, memory->name);
  in_use_.push_back(memory);
  return *memory;
}

// The command buffer to record to.
vk::raii::CommandBuffer& Recorder::Implementation::BeginStep(const std::string& name) {
  if (!is_recording_) {
    if (num_command_buffers_ == command_buffers_.size()) {
      command_buffers_.push_back(std::move(
          device_->vulkan()
              .allocateCommandBuffers({*command_pool_, vk::CommandBufferLevel::ePrimary, 1})
              .front()));
    }
    command_buffers_[num_command_buffers_].begin({vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
    ++num_command_buffers_;
    is_recording_ = true;
  }
  vk::raii::CommandBuffer& commands = command_buffers_[num_command_buffers_ - 1];
  clock_.BeginStep(commands, name);
  BarrierBetweenSteps(commands);
  return commands;
}

void Recorder::Implementation::EndCommands() {
  if (!is_recording_) return;
  const vk::raii::CommandBuffer& commands = command_buffers_[num_command_buffers_ - 1];
  clock_.EndLastStep(commands);
  BarrierToHost(commands);
  commands.end();
  is_recording_ = false;
}

void Recorder::Implementation::Dispatch(const std::shared_ptr<const KernelPipeline>& kernel,
                                        const std::vector<BufferMemory*>& buffers,
                                        std::span<const std::byte> push,
                                        const std::array<std::uint32_t, 3>& num_workgroups) {
  RequireOwn(*kernel->device, kernel->name);
  if (kernel->host != nullptr) {
    HostStep step{.kernel = kernel.get(),
                  .buffers = {},
                  .push = {push.begin(), push.end()},
                  .num_workgroups = num_workgroups[0] * num_workgroups[1] * num_workgroups[2]};
    for (const BufferMemory* buffer : buffers) step.buffers.push_back(buffer->mapped);
    in_use_.push_back(kernel);
    EndCommands();
    step.num_command_buffers = num_command_buffers_;
    host_steps_.push_back(std::move(step));
    return;
  }
  const vk::DescriptorSet set = descriptors_.Make(*kernel, buffers);
  in_use_.push_back(kernel);
  const vk::raii::CommandBuffer& commands = BeginStep(kernel->name);
  constexpr auto kCompute = vk::PipelineBindPoint::eCompute;
  commands.bindPipeline(kCompute, *kernel->pipeline);
  if (!buffers.empty()) commands.bindDescriptorSets(kCompute, *kernel->layout, 0, set, {});
  if (!push.empty()) {
    commands.pushConstants<std::byte>(*kernel->layout, vk::ShaderStageFlagBits::eCompute, 0,
                                      {static_cast<std::uint32_t>(push.size()), push.data()});
  }
  commands.dispatch(num_workgroups[0], num_workgroups[1], num_workgroups[2]);
}

void Recorder::Implementation::Fill(const BufferMemory& buffer, std::uint32_t value) {
  BeginStep("gpu/fill").fillBuffer(*buffer.buffer, 0, buffer.allocated_bytes, value);
}

void Recorder::Implementation::Copy(const BufferMemory& from, const BufferMemory& to,
                                    const vk::BufferCopy& region) {
  BeginStep("gpu/copy").copyBuffer(*from.buffer, *to.buffer, region);
}

void Recorder::Implementation::RunHostStep(const HostStep& step) {
  const double start_ms = WallClockMs();
  device_->host_threads()->Run(step.kernel->host, {.constants = step.kernel->specialization,
                                                   .push = step.push,
                                                   .buffers = step.buffers,
                                                   .num_workgroups = step.num_workgroups});
  clock_.AddHostStep(step.kernel->name, WallClockMs() - start_ms);
}

void Recorder::Implementation::RunAll() {
  EndCommands();
  auto host_step = host_steps_.begin();
  for (std::size_t i = 0; i <= num_command_buffers_; ++i) {
    for (; host_step != host_steps_.end() && host_step->num_command_buffers == i; ++host_step) {
      RunHostStep(*host_step);
    }
    if (i < num_command_buffers_) device_->Run(command_buffers_[i], fence_, "the submission");
  }
}

void Recorder::Implementation::Submit(StageTimes* times) {
  try {
    RunAll();
    if (times != nullptr) clock_.AddTo(*times);
  } catch (...) {
    is_recording_ = false;  // the device is lost: nothing here can be used again
    num_command_buffers_ = 0;
    host_steps_.clear();
    throw;
  }
  Clear();
}

void Recorder::Implementation::Clear() {
  is_recording_ = false;
  num_command_buffers_ = 0;
  host_steps_.clear();
  command_pool_.reset();
  descriptors_.Reset();
  clock_.Reset();
  in_use_.clear();
}

Recorder::Recorder(std::shared_ptr<Device> device) {
  const std::string name = device->info().name;
  implementation_ = CallVulkan(name, "making a recorder",
                               [&] { return std::make_unique<Implementation>(std::move(device)); });
}

Recorder::~Recorder() = default;
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;

void Recorder::DispatchBytes(const Kernel& kernel, BufferSpan buffers, const void* push,
                             std::size_t push_bytes, std::array<std::uint32_t, 3> num_workgroups) {
  CheckDispatch(*kernel.pipeline_, buffers.size(), push_bytes, num_workgroups);
  std::vector<BufferMemory*> memories;
  for (const Buffer& buffer : buffers) {
    memories.push_back(&implementation_->Use(buffer.memory_, kernel.name()));
  }
  if (num_workgroups[0] == 0 || num_workgroups[1] == 0 || num_workgroups[2] == 0) return;
  CallVulkan(kernel.name(), "recording", [&] {
    implementation_->Dispatch(kernel.pipeline_, memories,
                              {static_cast<const std::byte*>(push), push_bytes}, num_workgroups);
  });
}

void Recorder::Fill(const Buffer& buffer, std::uint32_t value) {
  const BufferMemory& memory = implementation_->Use(buffer.memory_, "gpu/fill");
  CallVulkan(memory.name, "recording", [&] { implementation_->Fill(memory, value); });
}

void Recorder::Copy(const Buffer& from, std::size_t from_offset_bytes, const Buffer& to,
                    std::size_t to_offset_bytes, std::size_t size_bytes) {
  const BufferMemory& from_memory = implementation_->Use(from.memory_, "gpu/copy");
  const BufferMemory& to_memory = implementation_->Use(to.memory_, "gpu/copy");
  CheckCopy(from_memory, from_offset_bytes, size_bytes);
  CheckCopy(to_memory, to_offset_bytes, size_bytes);
  if (size_bytes == 0) return;
  if (&from_memory == &to_memory && from_offset_bytes < to_offset_bytes + size_bytes &&
      to_offset_bytes < from_offset_bytes + size_bytes) {
    throw Error(
        {"the copy overlaps itself", from_memory.name, {}, {}, ErrorCode::kInvalidArgument});
  }
  CallVulkan(from_memory.name, "recording", [&] {
    implementation_->Copy(from_memory, to_memory, {from_offset_bytes, to_offset_bytes, size_bytes});
  });
}

void Recorder::Submit(StageTimes* times) {
  CallVulkan(implementation_->device_name(), "the submission",
             [&] { implementation_->Submit(times); });
}

}  // namespace mono3d
