// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cstdint>
#include <string>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "tracking/map/map_bytes.h"

namespace mono3d::fuzz {

void SavedMap(std::string_view input) {
  // Without the right one, hardly an input would get past it.
  const std::string bytes = tracking::WithChecksum(std::string(input));
  const auto saved = ReadOrRefuse([&] { return tracking::FromBytes(bytes, "input"); });
  if (!saved) return;
  static_cast<void>(tracking::FromBytes(
      tracking::ToBytes(*saved->map, saved->features, saved->frames), "written"));
}

}  // namespace mono3d::fuzz
