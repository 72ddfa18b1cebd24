// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/instance.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "mono3d/core/log.h"

namespace mono3d {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
// lavapipe runs without any GPU, so this package always helps.
constexpr const char* kDriverHint =
    "install the driver of your GPU, or the Debian package mesa-vulkan-drivers, which brings the "
    "software device lavapipe";

vk::raii::Context LoadVulkan() {
  try {
    return vk::raii::Context();
  } catch (const std::runtime_error&) {
    throw Error(
        "the Vulkan loader libvulkan.so.1 is missing: install the Debian packages libvulkan1 and "
        "mesa-vulkan-drivers (the software device lavapipe)",
        ErrorCode::kDevice);
  }
}

VKAPI_ATTR VkBool32 VKAPI_CALL OnMessage(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                         VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data,
                                         void* counter) {
  ++*static_cast<std::atomic<std::int64_t>*>(counter);
  Log(LogLevel::kWarning, std::string("Vulkan validation: ") + data->pMessage);
  return VK_FALSE;
}

vk::DebugUtilsMessengerCreateInfoEXT MessengerInfo(std::atomic<std::int64_t>* counter) {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
  // Not Type::eGeneral: there the loader tells of drivers that do not fit this machine.
  return {{},
          Severity::eWarning | Severity::eError,
          Type::eValidation | Type::ePerformance,
          OnMessage,
          counter};
}

void RequireValidationLayer(const vk::raii::Context& context) {
  for (const vk::LayerProperties& layer : context.enumerateInstanceLayerProperties()) {
    if (std::strcmp(layer.layerName, kValidationLayer) == 0) return;
  }
  throw Error(
      "the Vulkan validation layer is missing: install the Debian package "
      "vulkan-validationlayers",
      ErrorCode::kDevice);
}

vk::raii::Instance MakeInstance(const vk::raii::Context& context,
                                const vk::InstanceCreateInfo& info) {
  try {
    return context.createInstance(info);
  } catch (const vk::IncompatibleDriverError&) {
    throw Error(std::string("no Vulkan driver found: ") + kDriverHint, ErrorCode::kDevice);
  } catch (const vk::SystemError& error) {
    throw MakeVulkanError({}, "opening Vulkan", static_cast<vk::Result>(error.code().value()));
  }
}

std::optional<std::uint32_t> ComputeQueueFamily(const vk::raii::PhysicalDevice& physical) {
  const auto families = physical.getQueueFamilyProperties();
  for (std::uint32_t i = 0; i < families.size(); ++i) {
    if (families[i].queueFlags & vk::QueueFlagBits::eCompute) return i;
  }
  return std::nullopt;
}

std::pair<int, const char*> RankAndName(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu:
      return {0, "discrete GPU"};
    case vk::PhysicalDeviceType::eIntegratedGpu:
      return {1, "integrated GPU"};
    case vk::PhysicalDeviceType::eVirtualGpu:
      return {2, "virtual GPU"};
    case vk::PhysicalDeviceType::eCpu:
      return {3, "CPU"};
    default:
      return {4, "other"};
  }
}

int Rank(const Candidate& candidate) {
  return RankAndName(candidate.physical.getProperties().deviceType).first;
}

DeviceInfo Describe(const vk::raii::PhysicalDevice& physical) {
  const auto chain =
      physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceDriverProperties>();
  const vk::PhysicalDeviceProperties& properties =
      chain.get<vk::PhysicalDeviceProperties2>().properties;
  const auto& driver = chain.get<vk::PhysicalDeviceDriverProperties>();
  DeviceInfo info;
  info.name = properties.deviceName.data();
  info.type = RankAndName(properties.deviceType).second;
  info.driver = std::string(driver.driverName.data()) + " " + driver.driverInfo.data();
  return info;
}

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool IsIndex(const std::string& text) {
  // Four digits hold any machine's devices and cannot overflow.
  return !text.empty() && text.size() <= 4 &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

}  // namespace

Instance CreateInstance(bool validation) {
  Instance result{LoadVulkan(), nullptr, std::make_unique<std::atomic<std::int64_t>>(0), nullptr};
  const vk::ApplicationInfo application("mono3d", 0, "mono3d", 0, VK_API_VERSION_1_3);
  vk::InstanceCreateInfo info({}, &application);
  if (!validation) {
    result.instance = MakeInstance(result.context, info);
    return result;
  }
  RequireValidationLayer(result.context);
  const std::array extensions = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                 VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
  // Finds missing barriers between the steps of a Recorder.
  const auto synchronization = vk::ValidationFeatureEnableEXT::eSynchronizationValidation;
  const vk::ValidationFeaturesEXT features(1, &synchronization);
  vk::DebugUtilsMessengerCreateInfoEXT messenger = MessengerInfo(result.num_messages.get());
  messenger.pNext = &features;  // for what comes while the instance itself is made and unmade
  info.setPEnabledLayerNames(kValidationLayer);
  info.setPEnabledExtensionNames(extensions);
  info.pNext = &messenger;
  result.instance = MakeInstance(result.context, info);
  result.messenger =
      result.instance.createDebugUtilsMessengerEXT(MessengerInfo(result.num_messages.get()));
  return result;
}

std::vector<Candidate> ListCandidates(const Instance& instance) {
  std::vector<Candidate> candidates;
  CallVulkan({}, "listing the Vulkan devices", [&] {
    for (vk::raii::PhysicalDevice& physical : vk::raii::PhysicalDevices(instance.instance)) {
      const std::optional<std::uint32_t> family = ComputeQueueFamily(physical);
      if (!family || physical.getProperties().apiVersion < VK_API_VERSION_1_2) continue;
      DeviceInfo info = Describe(physical);
      candidates.push_back({std::move(physical), *family, std::move(info)});
    }
  });
  if (candidates.empty()) {
    throw Error(std::string("no device with Vulkan 1.2 and compute found: ") + kDriverHint,
                ErrorCode::kDevice);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return Rank(a) < Rank(b); });
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    candidates[i].info.index = static_cast<int>(i);
  }
  return candidates;
}

std::size_t ChooseCandidate(const std::vector<Candidate>& candidates, const std::string& wanted) {
  if (wanted.empty()) return 0;
  if (IsIndex(wanted)) {
    const std::size_t index = std::stoul(wanted);
    if (index < candidates.size()) return index;
  }
  std::string names;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const std::string& name = candidates[i].info.name;
    if (!IsIndex(wanted) && LowerCase(name).find(LowerCase(wanted)) != std::string::npos) return i;
    names += (i == 0 ? "" : ", ") + std::to_string(i) + ": " + name;
  }
  throw UsageError({"no such Vulkan device", {}, "an index or part of a name of " + names, wanted});
}

}  // namespace mono3d
