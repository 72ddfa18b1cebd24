// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "mono3d/gpu/device.h"

namespace mono3d {

// The default device with the validation layer on, opened at the first call and shared by all tests
// of the program. When the program ends, it fails if the layer had anything to say: add
// ../gpu/test_device.cpp to the sources of the test program. With MONO3D_TEST_KERNELS=shaders in
// the environment it is ShaderTestDevice().
std::shared_ptr<Device> TestDevice();

// The same device without host kernels.
std::shared_ptr<Device> ShaderTestDevice();

// The same device, treated as one whose memory the host cannot see: transfers are staged.
std::shared_ptr<Device> StagedTestDevice();

}  // namespace mono3d
