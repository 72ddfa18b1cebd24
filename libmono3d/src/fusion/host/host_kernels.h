// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "gpu/host_kernel.h"

namespace mono3d {

// Kernels of fusion as compiled code (gpu/host_kernel.h), which a device that computes on the
// processor runs in place of shaders/fusion/<stage>.comp; what they do, and the shape and unit of
// their buffers, stands there. Null where there is none for this processor.
extern const HostKernel kAssociateOnHost;
extern const HostKernel kAssociateDrawOnHost;
extern const HostKernel kMergeOnHost;
extern const HostKernel kSelectNewOnHost;

}  // namespace mono3d
