// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/dense.h"

#include "mono3d/core/options.h"
#include "mono3d/products/dense_workspace.h"

namespace mono3d::tools {

Product DenseProduct() {
  static double min_confidence = 0;  // of the command line
  return {"dense", "dense/, images and depth maps for COLMAP's stereo_fusion and OpenMVS",
          [](CLI::App& app) {
            app.add_option("--dense-confidence", min_confidence,
                           "dense: leave out depth of less confidence, 0 to 1")
                ->capture_default_str();
          },
          [](const FinishedRun& run, const std::filesystem::path& folder) {
            RequireOption(min_confidence >= 0 && min_confidence <= 1, "dense-confidence", "0 to 1",
                          min_confidence);
            return WriteDenseWorkspace(folder / "dense", run, min_confidence);
          }};
}

}  // namespace mono3d::tools
