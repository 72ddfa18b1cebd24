// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/depth.h"

#include "mono3d/products/dense_workspace.h"

namespace mono3d::tools {

Product DepthProduct() {
  return {"depth",
          "depth/NAME.tif, depth maps as 32-bit floats in the unit of the model",
          {},
          [](const FinishedRun& run, const std::filesystem::path& folder) {
            return WriteDepthTiffs(folder / "depth", run);
          }};
}

}  // namespace mono3d::tools
