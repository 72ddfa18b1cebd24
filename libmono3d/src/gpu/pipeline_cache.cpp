// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/pipeline_cache.h"

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include "mono3d/core/atomic_file.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Before the data in the file. The driver checks what it is given for its own version, but need not
// survive damage.
struct FileHeader {
  std::array<char, 8> name{'m', '3', 'd', 'p', 'i', 'p', 'e', '1'};
  std::uint64_t num_bytes = 0;
  std::uint64_t hash = 0;
};

// FNV-1a, 64 bits.
std::uint64_t HashOf(const std::vector<std::byte>& data) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const std::byte byte : data) {
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3u;
  }
  return hash;
}

std::string Hex(std::uint64_t value, int num_digits) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (int i = num_digits - 1; i >= 0; --i) text += kDigits[value >> (4 * i) & 15u];
  return text;
}

// Another driver, or another version of it, has another file.
std::string FileName(const vk::PhysicalDeviceProperties& properties) {
  std::string name = "pipelines-" + Hex(properties.vendorID, 8) + "-" +
                     Hex(properties.deviceID, 8) + "-" + Hex(properties.driverVersion, 8) + "-";
  for (const std::uint8_t byte : properties.pipelineCacheUUID) name += Hex(byte, 2);
  return name + ".bin";
}

}  // namespace

std::filesystem::path CacheFolder() {
  for (const auto& [variable, below] : {std::pair("XDG_CACHE_HOME", ""), {"HOME", ".cache"}}) {
    const char* value = std::getenv(variable);
    if (value != nullptr && std::filesystem::path(value).is_absolute()) {
      return std::filesystem::path(value) / below / "mono3d";
    }
  }
  return {};
}

std::optional<std::vector<std::byte>> ReadCacheFile(const std::filesystem::path& file) {
  std::error_code failure;
  const std::uintmax_t size = std::filesystem::file_size(file, failure);
  FileHeader header;
  const FileHeader expected;
  std::ifstream stream(file, std::ios::binary);
  if (failure || size < sizeof(header)) return std::nullopt;
  if (!stream.read(reinterpret_cast<char*>(&header), sizeof(header))) return std::nullopt;
  if (header.name != expected.name || header.num_bytes != size - sizeof(header)) {
    return std::nullopt;
  }
  std::vector<std::byte> data(header.num_bytes);
  if (!stream.read(reinterpret_cast<char*>(data.data()),
                   static_cast<std::streamsize>(data.size()))) {
    return std::nullopt;
  }
  if (HashOf(data) != header.hash) return std::nullopt;
  return data;
}

void WriteCacheFile(const std::filesystem::path& file, const std::vector<std::byte>& data) {
  std::error_code ignored;  // that the folder is not there shows when the file is created
  std::filesystem::create_directories(file.parent_path(), ignored);
  FileHeader header;
  header.num_bytes = data.size();
  header.hash = HashOf(data);
  AtomicFile output(file, "." + std::to_string(getpid()) + ".partial");
  output.Write({reinterpret_cast<const char*>(&header), sizeof(header)});
  output.Write({reinterpret_cast<const char*>(data.data()), data.size()});
  output.Commit(Durability::kInCache);
}

PipelineCache::PipelineCache(const vk::raii::PhysicalDevice& physical,
                             const vk::raii::Device& device) {
  const std::filesystem::path folder = CacheFolder();
  std::vector<std::byte> data;
  if (!folder.empty()) {
    file_ = folder / FileName(physical.getProperties());
    data = ReadCacheFile(file_).value_or(std::vector<std::byte>());
  }
  loaded_bytes_ = data.size();
  cache_ = device.createPipelineCache({{}, data.size(), data.data()});
}

void PipelineCache::Save() const {
  if (file_.empty()) return;
  const std::vector<std::uint8_t> data = cache_.getData();
  // A driver without a cache gives the bare header.
  if (data.size() <= sizeof(VkPipelineCacheHeaderVersionOne) || data.size() == loaded_bytes_) {
    return;
  }
  std::vector<std::byte> bytes(data.size());
  std::memcpy(bytes.data(), data.data(), data.size());
  WriteCacheFile(file_, bytes);
}

PipelineCache::~PipelineCache() {
  try {
    Save();
  } catch (const std::exception& error) {
    try {
      Log(LogLevel::kDebug, error.what());
    } catch (...) {  // nothing is worth ending the process here
    }
  }
}

}  // namespace mono3d
