// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What libFuzzer calls at the start and with each input: mono3d_fuzz --target=camera ...

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <string_view>

#include "fuzz/fuzz_targets.h"

namespace {

const mono3d::fuzz::FuzzTarget* chosen = nullptr;

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): the names are libFuzzer's, which passes over options
// with two dashes.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kOption = "--target=";
  for (int i = 1; i < *argc; ++i) {
    const std::string_view word = (*argv)[i];
    if (!word.starts_with(kOption)) continue;
    const std::string_view name = word.substr(kOption.size());
    for (const auto& target : mono3d::fuzz::kFuzzTargets) {
      if (target.name == name) chosen = &target;
    }
  }
  if (chosen == nullptr) {
    std::fputs("mono3d_fuzz: expected --target= and the name of a folder in corpus/\n", stderr);
    std::exit(2);
  }
  // What libFuzzer makes of an input follows from the code that ran, which threads would change
  // from run to run.
  cv::setNumThreads(1);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run({reinterpret_cast<const char*>(data), size});
  return 0;
}
// NOLINTEND(readability-identifier-naming)
