// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/map_file.h"

#include "io/text.h"
#include "mono3d/io/output_file.h"

namespace mono3d {

void SaveMapFile(const Tracker& tracker, const std::filesystem::path& path) {
  WriteFileAtomically(path, tracker.SaveMap());
}

void LoadMapFile(Tracker& tracker, const std::filesystem::path& path) {
  tracker.LoadMap(ReadBytes(path), path.string());
}

}  // namespace mono3d
