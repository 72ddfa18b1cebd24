// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/nerfstudio.h"

#include "mono3d/products/nerfstudio_file.h"

namespace mono3d::tools {

Product NerfstudioProduct() {
  static bool is_undistorted = false;  // of the command line
  return {"nerfstudio", "nerfstudio/transforms.json, cameras and poses for trainers of splats",
          [](CLI::App& app) {
            app.add_flag("--undistorted", is_undistorted,
                         "nerfstudio: with images free of distortion, as PNG");
          },
          [](const FinishedRun& run, const std::filesystem::path& folder) {
            return WriteNerfstudio(folder / "nerfstudio", run, is_undistorted);
          }};
}

}  // namespace mono3d::tools
