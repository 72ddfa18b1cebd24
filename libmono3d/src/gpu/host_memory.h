// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "mono3d/gpu/device.h"

namespace mono3d {

// Whether buffers are mapped where the device allows it. kHidden treats every device as a discrete
// GPU whose memory the host cannot see, so that tests reach the staging path on any machine.
enum class HostMemory { kMappedIfPossible, kHidden };

// OpenDevice with that choice.
std::shared_ptr<Device> OpenDeviceWith(const DeviceOptions& options, HostMemory host_memory);

}  // namespace mono3d
