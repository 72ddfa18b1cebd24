// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/residency.h"

#include <unistd.h>

#include <algorithm>
#include <limits>
#include <system_error>

#include "fusion/surfel.h"
#include "gpu/device_handle.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kBytesPerMb = std::uint64_t{1} << 20U;
// With its association.
constexpr std::uint64_t kBytesOnDevice = kBytesPerSurfel + sizeof(std::uint32_t);

// The rest is for images, depth maps, what else the host does, and other programs.
constexpr std::uint64_t kShareOfDevice = 4;
constexpr std::uint64_t kShareOfHost = 8;

std::uint64_t HostMemoryBytes() {
  const long num_pages = sysconf(_SC_PHYS_PAGES);
  const long page_bytes = sysconf(_SC_PAGESIZE);
  if (num_pages <= 0 || page_bytes <= 0) return 0;
  return static_cast<std::uint64_t>(num_pages) * static_cast<std::uint64_t>(page_bytes);
}

}  // namespace

std::uint32_t MaxSurfelsOnDevice(const Device& device, const SurfelStorageOptions& options,
                                 double share) {
  const std::uint64_t bytes = options.max_device_mb > 0
                                  ? static_cast<std::uint64_t>(options.max_device_mb) * kBytesPerMb
                                  : Limits(device).memory_bytes / kShareOfDevice;
  const double surfels = share * static_cast<double>(bytes / kBytesOnDevice);
  constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::min(surfels, kMost));
}

std::size_t MaxHostBytes(const SurfelStorageOptions& options) {
  return options.max_host_mb > 0 ? static_cast<std::size_t>(options.max_host_mb) * kBytesPerMb
                                 : HostMemoryBytes() / kShareOfHost;
}

std::filesystem::path DepotFolder(const SurfelStorageOptions& options) {
  if (!options.folder.empty()) return options.folder;
  std::error_code ignored;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(ignored);
  return folder.empty() ? std::filesystem::path("/tmp") : folder;
}

}  // namespace mono3d
