// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <filesystem>
#include <string>
#include <vector>

#include "evaluate/run_record.h"
#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "view/run_folder.h"

namespace mono3d::fuzz {

void RunRecord(std::string_view input) {
  static const InputFolder folder("run_record");
  static const std::vector<std::filesystem::path> others = {
      folder.Write("model.ply", ""),
      folder.Write("sparse/cameras.txt", "1 PINHOLE 64 48 50 50 32 24\n"),
      folder.Write("sparse/images.txt", "1 1 0 0 0 0 0 0 1 000000.jpg\n\n"),
      folder.Write("sparse/points3D.txt", "")};
  const auto file = folder.Write("run.json", input);
  static_cast<void>(ReadOrRefuse([&] { return tools::RecordSection(tools::ReadRecord(file)); }));
  static_cast<void>(ReadOrRefuse([&] {
    tools::ViewStore store;
    tools::RunFolder(folder.path()).Show(store, 1, {});
    return store.Changes(0);
  }));
}

}  // namespace mono3d::fuzz
