// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/splats.h"

#include "mono3d/products/splat_file.h"

namespace mono3d::tools {

Product SplatsProduct() {
  return {"splats",
          "splats.ply, the surfels as 3D Gaussians",
          {},
          [](const FinishedRun& run, const std::filesystem::path& folder) {
            const std::filesystem::path file = folder / "splats.ply";
            WriteSplatsOf(run.model, file);
            return std::vector<std::filesystem::path>{file};
          }};
}

}  // namespace mono3d::tools
