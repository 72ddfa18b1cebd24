// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <string>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/pfm_file.h"

namespace mono3d::fuzz {

void DepthImage(std::string_view input) {
  static const InputFolder folder("depth_image");
  static const auto scale = folder.Write("scale.txt", "1000\n");
  const auto file = folder.Write("000001.depth", input);
  const auto depth = ReadOrRefuse([&] { return ReadDepthImage(file); });
  if (depth) WritePfm(folder.path() / "written.pfm", *depth);
  static_cast<void>(ReadOrRefuse([&] { return ReadPfm(file); }));
}

}  // namespace mono3d::fuzz
