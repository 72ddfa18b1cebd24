// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/test_device.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <iostream>
#include <string_view>
#include <utility>

#include "gpu/device_handle.h"
#include "gpu/host_memory.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

std::shared_ptr<Device>& Slot(HostMemory host_memory) {
  static std::shared_ptr<Device> mapped;
  static std::shared_ptr<Device> staged;
  return host_memory == HostMemory::kHidden ? staged : mapped;
}

std::shared_ptr<Device> Open(HostMemory host_memory) {
  std::shared_ptr<Device>& slot = Slot(host_memory);
  if (!slot) slot = OpenDeviceWith({.device = "", .validation = true}, host_memory);
  return slot;
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
    for (const HostMemory host_memory : {HostMemory::kMappedIfPossible, HostMemory::kHidden}) {
      std::shared_ptr<Device> device = std::move(Slot(host_memory));
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

std::shared_ptr<Device> TestDevice() { return Open(HostMemory::kMappedIfPossible); }

std::shared_ptr<Device> StagedTestDevice() { return Open(HostMemory::kHidden); }

}  // namespace mono3d
