// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/pipeline_cache.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "gpu/device_handle.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A folder of its own that is also the user's cache folder.
class PipelineCacheFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) / "mono3d_pipeline_cache";
    std::filesystem::remove_all(folder_);
    const char* before = std::getenv("XDG_CACHE_HOME");
    if (before != nullptr) before_ = before;
    setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  }
  void TearDown() override {
    if (before_.empty()) {
      unsetenv("XDG_CACHE_HOME");
    } else {
      setenv("XDG_CACHE_HOME", before_.c_str(), 1);
    }
    std::filesystem::remove_all(folder_);
  }

  static std::vector<std::byte> SomeData() {
    std::vector<std::byte> data;
    for (int i = 0; i < 1000; ++i) data.push_back(static_cast<std::byte>(i * i));
    return data;
  }

  std::filesystem::path folder_;
  std::string before_;
};

TEST_F(PipelineCacheFile, LiesInTheUsersCacheFolder) {
  EXPECT_EQ(CacheFolder(), folder_ / "mono3d");
  setenv("XDG_CACHE_HOME", "relative/folders/do/not/count", 1);
  const char* home = std::getenv("HOME");
  EXPECT_EQ(CacheFolder(), home == nullptr ? std::filesystem::path()
                                           : std::filesystem::path(home) / ".cache/mono3d");
}

TEST_F(PipelineCacheFile, IsReadAsWritten) {
  const std::filesystem::path file = CacheFolder() / "pipelines.bin";
  EXPECT_EQ(ReadCacheFile(file), std::nullopt);
  WriteCacheFile(file, SomeData());
  EXPECT_EQ(ReadCacheFile(file), SomeData());
  WriteCacheFile(file, {});
  EXPECT_EQ(ReadCacheFile(file), std::vector<std::byte>());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(CacheFolder()), {}), 1);
}

TEST_F(PipelineCacheFile, IsIgnoredWhenDamaged) {
  const std::filesystem::path file = CacheFolder() / "pipelines.bin";
  WriteCacheFile(file, SomeData());
  const auto size = std::filesystem::file_size(file);
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(size / 2));
  stream.put('?');
  stream.close();
  EXPECT_EQ(ReadCacheFile(file), std::nullopt);
  WriteCacheFile(file, SomeData());
  for (const auto bytes : {size - 1, std::uintmax_t{5}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(file, bytes);
    EXPECT_EQ(ReadCacheFile(file), std::nullopt);
  }
  EXPECT_EQ(ReadCacheFile(CacheFolder()), std::nullopt);  // a folder
}

TEST_F(PipelineCacheFile, ThatCannotBeWrittenIsAnErrorAndNoFile) {
  // A file stands where the folder should be.
  std::ofstream(folder_.string()) << "no folder";
  EXPECT_THROW(WriteCacheFile(CacheFolder() / "pipelines.bin", SomeData()), Error);
}

TEST_F(PipelineCacheFile, DoesNotStopADeviceFromOpening) {
  std::ofstream(folder_.string()) << "no folder";
  EXPECT_NO_THROW(OpenDevice());
  unsetenv("XDG_CACHE_HOME");
  EXPECT_NO_THROW(OpenDevice());
}

}  // namespace
}  // namespace mono3d
