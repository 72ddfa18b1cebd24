// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "io/image_list.h"
#include "io/image_source.h"
#include "io/video_prior.h"
#include "mono3d/io/timestamps_file.h"

namespace mono3d::fuzz {

void Sequence(std::string_view input) {
  static const InputFolder folder("sequence");
  static const std::vector<std::filesystem::path> images = {folder.Write("1.jpg", ""),
                                                            folder.Write("02.jpg", "")};
  const auto file = folder.Write("timestamps.txt", input);
  static_cast<void>(ReadOrRefuse([&] { return ReadTimestamps(file); }));
  static_cast<void>(ReadOrRefuse([&] { return FindImages(folder.path()); }));
  const auto focal = ParseTelemetryFocal(input);
  if (focal && !(focal->focal_35mm > 0)) throw std::runtime_error("a focal length that is none");
  static_cast<void>(ParseSize(std::string(input)));

  constexpr std::size_t kMaxNames = 8;
  std::vector<std::string_view> names;
  while (!input.empty() && names.size() < kMaxNames) {
    const std::size_t end = std::min(input.find('\n'), input.size());
    names.push_back(input.substr(0, end));
    input.remove_prefix(std::min(end + 1, input.size()));
  }
  // std::sort reads beyond the list where the order is none.
  for (const std::string_view a : names) {
    for (const std::string_view b : names) {
      if (NaturalLess(a, b) && NaturalLess(b, a)) throw std::runtime_error("no order of two names");
      for (const std::string_view c : names) {
        if (NaturalLess(a, b) && NaturalLess(b, c) && !NaturalLess(a, c)) {
          throw std::runtime_error("no order of three names");
        }
      }
    }
  }
}

}  // namespace mono3d::fuzz
