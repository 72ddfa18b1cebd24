// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/gpu/device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#ifdef __linux__
#include <sys/resource.h>
#endif

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <string>

#include "gpu/device_handle.h"
#include "gpu/device_internals.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::HasSubstr;

// Runs `action` in a process of its own, which has changed the environment of the Vulkan loader,
// and ends it with the error on stderr.
[[noreturn]] void EndWithError(const char* variable, const char* value,
                               const std::function<void()>& action) {
  setenv(variable, value, 1);
  try {
    action();
    std::cerr << "no error";
  } catch (const Error& error) {
    std::cerr << error.what();
  }
  std::exit(0);
}

class DeviceInProcessOfItsOwn : public ::testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST(ListDevices, NumbersThemBestFirst) {
  const std::vector<DeviceInfo> devices = ListDevices();
  ASSERT_FALSE(devices.empty());
  const std::vector<std::string> order = {"discrete GPU", "integrated GPU", "virtual GPU", "CPU",
                                          "other"};
  std::ptrdiff_t last_rank = 0;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(devices[i].index, static_cast<int>(i));
    EXPECT_FALSE(devices[i].name.empty());
    EXPECT_FALSE(devices[i].driver.empty());
    const auto rank = std::find(order.begin(), order.end(), devices[i].type) - order.begin();
    EXPECT_GE(rank, last_rank);
    last_rank = rank;
  }
}

TEST(OpenDevice, TakesTheFirstByDefault) {
  EXPECT_EQ(Info(*OpenDevice()).name, ListDevices().front().name);
}

TEST(OpenDevice, TakesAnIndex) {
  for (const DeviceInfo& device : ListDevices()) {
    EXPECT_EQ(
        Info(*OpenDevice({.device = std::to_string(device.index), .validation = false})).index,
        device.index);
  }
}

#ifdef __linux__
// Nice values of this process's threads, by the thread's number.
std::map<std::string, int> NiceValues() {
  std::map<std::string, int> values;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    const std::string number = thread.path().filename().string();
    values[number] = getpriority(PRIO_PROCESS, static_cast<id_t>(std::stoul(number)));
  }
  return values;
}

TEST(OpenDevice, HasThreadsOfItsOwnThatYield) {
  const std::map<std::string, int> before = NiceValues();
  const auto device = OpenDevice({.device = {}, .yields = true});
  if (Info(*device).type != "CPU") GTEST_SKIP() << "the device is not this processor";
  int num_started = 0;
  for (const auto& [thread, nice_value] : NiceValues()) {
    const auto known = before.find(thread);
    if (known != before.end()) {
      EXPECT_EQ(nice_value, known->second);
      continue;
    }
    ++num_started;
    EXPECT_GE(nice_value, std::min(getpriority(PRIO_PROCESS, 0) + 10, 19));
  }
  EXPECT_GT(num_started, 0);
}
#endif

TEST(OpenDevice, TakesAPartOfTheNameInAnyCase) {
  const std::string name = ListDevices().front().name;
  std::string part = name.substr(1, 5);
  std::transform(part.begin(), part.end(), part.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  EXPECT_EQ(Info(*OpenDevice({.device = part, .validation = false})).name, name);
}

TEST(OpenDevice, RefusesAnUnknownNameAndSaysWhatThereIs) {
  try {
    OpenDevice({.device = "Voodoo 2", .validation = false});
    FAIL() << "no error";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Voodoo 2"));
    EXPECT_THAT(error.what(), HasSubstr(ListDevices().front().name));
  }
}

TEST(OpenDevice, RefusesAnIndexBeyondTheLast) {
  EXPECT_THROW(OpenDevice({.device = std::to_string(ListDevices().size()), .validation = false}),
               UsageError);
  EXPECT_THROW(OpenDevice({.device = "-1", .validation = false}), UsageError);
  EXPECT_THROW(OpenDevice({.device = "99999999999999999999999", .validation = false}), UsageError);
}

TEST_F(DeviceInProcessOfItsOwn, NamesThePackageWhenThereIsNoDriver) {
  EXPECT_EXIT(EndWithError("VK_DRIVER_FILES", "/nonexistent", [] { ListDevices(); }),
              ::testing::ExitedWithCode(0), "no Vulkan driver.*mesa-vulkan-drivers");
  EXPECT_EXIT(EndWithError("VK_DRIVER_FILES", "/nonexistent", [] { OpenDevice(); }),
              ::testing::ExitedWithCode(0), "no Vulkan driver.*mesa-vulkan-drivers");
}

TEST_F(DeviceInProcessOfItsOwn, NamesThePackageWhenThereIsNoValidationLayer) {
  EXPECT_EXIT(EndWithError("VK_LAYER_PATH", "/nonexistent",
                           [] { OpenDevice({.device = "", .validation = true}); }),
              ::testing::ExitedWithCode(0), "validation layer.*vulkan-validationlayers");
}

// In a process of its own, because here a message fails the whole test program.
TEST_F(DeviceInProcessOfItsOwn, CountsValidationMessages) {
  const auto count_after_mistake = [] {
    const auto device = OpenDevice({.device = "", .validation = true});
    const auto before = NumValidationMessages(*device);
    // The driver may accept or refuse it; the layer has to speak up.
    try {
      const auto buffer = device->vulkan().createBuffer({});
    } catch (const vk::SystemError&) {
    }
    throw Error(before == 0 && NumValidationMessages(*device) > 0 ? "was counted" : "was missed");
  };
  EXPECT_EXIT(EndWithError("MONO3D_UNUSED", "", count_after_mistake), ::testing::ExitedWithCode(0),
              "was counted");
}

TEST(Limits, ReachWhatVulkanPromises) {
  const DeviceLimits& limits = Limits(*TestDevice());
  // The specification's minima.
  EXPECT_GE(limits.max_storage_buffer_bytes, std::uint64_t{1} << 27);
  EXPECT_GE(limits.max_texel_buffer_elements, 65536U);
  EXPECT_GE(limits.max_push_constant_bytes, 128U);
  EXPECT_GE(limits.max_shared_memory_bytes, 16384U);
  EXPECT_GE(limits.max_workgroup_invocations, 128U);
  EXPECT_GE(limits.max_workgroup_size[0], 128U);
  EXPECT_GE(limits.max_workgroup_count[0], 65535U);
  EXPECT_GE(limits.subgroup_size, 1U);
  EXPECT_EQ(limits.is_cpu, Info(*TestDevice()).type == "CPU");
}

}  // namespace
}  // namespace mono3d
