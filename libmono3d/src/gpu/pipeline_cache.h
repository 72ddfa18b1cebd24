// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "gpu/vulkan_calls.h"

namespace mono3d {

// Compiled pipelines from one process to the next, in a file of the user's cache folder for each
// device and driver. A file that is missing, broken or cannot be written costs time, never an
// error; the log says so.
class PipelineCache {
 public:
  PipelineCache(const vk::raii::PhysicalDevice& physical, const vk::raii::Device& device);
  // Writes the file when there are pipelines that it did not have.
  ~PipelineCache();
  PipelineCache(const PipelineCache&) = delete;
  PipelineCache& operator=(const PipelineCache&) = delete;

  // Thread-safe.
  const vk::raii::PipelineCache& vulkan() const { return cache_; }

 private:
  void Save() const;

  std::filesystem::path file_;  // empty: there is no cache folder
  std::size_t loaded_bytes_ = 0;
  vk::raii::PipelineCache cache_ = nullptr;
};

// $XDG_CACHE_HOME/mono3d, else $HOME/.cache/mono3d; empty when neither variable is an absolute
// path.
std::filesystem::path CacheFolder();

// What WriteCacheFile wrote. Nothing when there is no such file, or it is not whole.
std::optional<std::vector<std::byte>> ReadCacheFile(const std::filesystem::path& file);

// Makes the folder, writes beside the file and renames, so that readers see all or nothing. Throws
// Error.
void WriteCacheFile(const std::filesystem::path& file, const std::vector<std::byte>& data);

}  // namespace mono3d
