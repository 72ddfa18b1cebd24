// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// A Vulkan device that can run compute shaders.
struct DeviceInfo {
  int index = 0;       // position in ListDevices()
  std::string name;    // "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string type;    // "discrete GPU", "integrated GPU", "virtual GPU", "CPU", "other"
  std::string driver;  // driver name and version
};

// The devices of this machine, best first: discrete GPU, integrated, virtual, CPU (lavapipe).
// Throws Error that names the package to install when there is no Vulkan loader or no driver.
std::vector<DeviceInfo> ListDevices();

struct DeviceOptions {
  std::string device;       // index in ListDevices() or part of a name; empty: the first
  bool validation = false;  // Khronos validation layer; its messages go to the log as warnings
  // Threads of a driver that computes on the processor yield to all others of the process, for
  // good: for live runs, whose tracking must not wait for depth. Not on every system.
  bool yields = false;
  // On a device that computes on the processor, kernels that the library has as compiled code, too,
  // run as such: the same results in less time than what the driver makes of their shaders takes.
  // False: all by the driver, to compare. On x86-64 with AVX2.
  bool host_kernels = true;
};

// An open device, shared by the stages that run on it. What it can do is private to the library.
class Device;

// Throws UsageError when no device fits `options.device`, Error when it cannot be opened.
std::shared_ptr<Device> OpenDevice(const DeviceOptions& options = {});

const DeviceInfo& Info(const Device& device);

}  // namespace mono3d
