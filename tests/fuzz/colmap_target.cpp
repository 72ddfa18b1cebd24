// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <string>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/io/colmap_model.h"

namespace mono3d::fuzz {

void Colmap(std::string_view input) {
  constexpr std::string_view kSeparator = "---\n";
  static const InputFolder folder("colmap");
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
    const std::size_t end = std::min(input.find(kSeparator), input.size());
    folder.Write(name, input.substr(0, end));
    input.remove_prefix(std::min(end + kSeparator.size(), input.size()));
  }
  const auto model = ReadOrRefuse([&] { return ReadColmapModel(folder.path()); });
  if (!model) return;
  const auto written = folder.path() / "written";
  WriteColmapModel(written, *model);
  static_cast<void>(ReadColmapModel(written));
}

}  // namespace mono3d::fuzz
