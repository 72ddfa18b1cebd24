// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What the fuzzers begin with, and every input that was once read wrongly.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fuzz/fuzz_targets.h"

namespace mono3d::fuzz {
namespace {

class FuzzCorpus : public testing::TestWithParam<FuzzTarget> {};

std::vector<std::filesystem::path> FilesOf(const FuzzTarget& target) {
  const std::filesystem::path folder = std::filesystem::path(MONO3D_FUZZ_CORPUS) / target.name;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  std::sort(files.begin(), files.end());
  return files;
}

// A few bytes must not ask for gigabytes. AddressSanitizer needs the address space for itself.
class MemoryLimit {
 public:
  MemoryLimit() {
#ifndef __SANITIZE_ADDRESS__
    getrlimit(RLIMIT_AS, &before_);
    std::size_t num_pages = 0;
    std::ifstream("/proc/self/statm") >> num_pages;
    rlimit limit = before_;
    limit.rlim_cur = num_pages * 4096 + (rlim_t{3} << 29U);
    setrlimit(RLIMIT_AS, &limit);
#endif
  }
  ~MemoryLimit() {
#ifndef __SANITIZE_ADDRESS__
    setrlimit(RLIMIT_AS, &before_);
#endif
  }
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;

 private:
  [[maybe_unused]] rlimit before_{};
};

TEST_P(FuzzCorpus, IsReadOrRefused) {
  const MemoryLimit limit;
  const std::vector<std::filesystem::path> files = FilesOf(GetParam());
  EXPECT_GE(files.size(), 2U);
  for (const std::filesystem::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    EXPECT_NO_THROW(GetParam().run(bytes)) << path;
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzCorpus, testing::ValuesIn(kFuzzTargets),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mono3d::fuzz
