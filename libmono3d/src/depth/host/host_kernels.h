// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "gpu/host_kernel.h"

namespace mono3d {

// Kernels of the depth stage as compiled code (gpu/host_kernel.h), which a device that computes on
// the processor runs in place of shaders/depth/<stage>.comp; what they do, and the shape and unit
// of their buffers, stands there. They give the same bits. Null where there is none for this
// processor.
extern const HostKernel kDetailOnHost;
extern const HostKernel kDogOnHost;
extern const HostKernel kFineCensusOnHost;
extern const HostKernel kFineSgmOnHost;
extern const HostKernel kInferenceOnHost;
extern const HostKernel kInferenceRelaxOnHost;
extern const HostKernel kPyramidOnHost;
extern const HostKernel kSurfaceOnHost;
extern const HostKernel kTextureFilterOnHost;

}  // namespace mono3d
