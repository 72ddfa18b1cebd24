// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "mono3d/fusion/surfel_map.h"
#include "mono3d/gpu/device.h"

namespace mono3d {

// Surfels that may be on the device by the options, of a storage that has this share of them.
std::uint32_t MaxSurfelsOnDevice(const Device& device, const SurfelStorageOptions& options,
                                 double share);
// Of a depot, by the options.
std::size_t MaxHostBytes(const SurfelStorageOptions& options);
std::filesystem::path DepotFolder(const SurfelStorageOptions& options);

}  // namespace mono3d
