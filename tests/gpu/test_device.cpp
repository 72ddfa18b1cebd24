// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/test_device.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <iostream>
#include <string_view>
#include <utility>

#include "gpu/device_handle.h"
#include "gpu/host_memory.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

enum class Way { kHostKernels, kShaders, kStaged };

std::shared_ptr<Device>& Slot(Way way) {
  static std::array<std::shared_ptr<Device>, 3> slots;
  return slots.at(static_cast<std::size_t>(way));
}

std::shared_ptr<Device> Open(Way way) {
  std::shared_ptr<Device>& slot = Slot(way);
  if (!slot) {
    DeviceOptions options;
    options.validation = true;
    options.host_kernels = way == Way::kHostKernels;
    slot = OpenDeviceWith(
        options, way == Way::kStaged ? HostMemory::kHidden : HostMemory::kMappedIfPossible);
  }
  return slot;
}

bool ShadersAreWanted() {
  const char* const kernels = std::getenv("MONO3D_TEST_KERNELS");
  return kernels != nullptr && std::string_view(kernels) == "shaders";
}

// Closes the devices before the program ends, so that objects left behind are reported as well.
class ValidationCheck : public ::testing::Environment {
 public:
  void SetUp() override {
    // The layer leaks a little with every pipeline. Kept in memory until the end, so that
    // LeakSanitizer can tell whose leak it is and finds it in tests/lsan.supp.
    dlopen("libVkLayer_khronos_validation.so", RTLD_LAZY | RTLD_NODELETE);
    SetLogSink([this](LogLevel level, std::string_view message) {
      std::cerr << message << '\n';
      if (level == LogLevel::kWarning && message.starts_with("Vulkan validation")) ++num_logged_;
    });
  }

  void TearDown() override {
    for (const Way way : {Way::kHostKernels, Way::kShaders, Way::kStaged}) {
      std::shared_ptr<Device> device = std::move(Slot(way));
      if (!device) continue;
      EXPECT_EQ(NumValidationMessages(*device), 0) << "messages of the Vulkan validation layer";
      EXPECT_EQ(device.use_count(), 1) << "something still holds the device: it cannot be checked";
      device.reset();
    }
    EXPECT_EQ(num_logged_, 0) << "messages of the Vulkan validation layer, closing included";
    SetLogSink(nullptr);
  }

 private:
  int num_logged_ = 0;
};

const ::testing::Environment* const kValidationCheck =
    ::testing::AddGlobalTestEnvironment(new ValidationCheck);

}  // namespace

std::shared_ptr<Device> TestDevice() {
  return Open(ShadersAreWanted() ? Way::kShaders : Way::kHostKernels);
}

std::shared_ptr<Device> ShaderTestDevice() { return Open(Way::kShaders); }

std::shared_ptr<Device> StagedTestDevice() { return Open(Way::kStaged); }

}  // namespace mono3d
