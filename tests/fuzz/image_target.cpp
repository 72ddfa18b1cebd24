// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "io/image_file.h"

namespace mono3d::fuzz {

void Image(std::string_view input) {
  static const InputFolder folder("image");
  const auto file = folder.Write("image.jpg", input);
  static_cast<void>(ReadOrRefuse([&] { return ReadImage(file); }));
}

}  // namespace mono3d::fuzz
