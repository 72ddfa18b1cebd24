// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/las.h"

#include "export/survey_options.h"
#include "mono3d/products/las_file.h"

namespace mono3d::tools {
namespace {

using ModelWriter = void (*)(const std::filesystem::path&, MapSurfels&, const MapAxes&);

std::vector<std::filesystem::path> WriteModelFile(const FinishedRun& run,
                                                  const std::filesystem::path& file,
                                                  ModelWriter write) {
  const MapAxes axes = TellAxes(run);
  MapSurfels surfels(run.model, axes);
  write(file, surfels, axes);
  return {file};
}

}  // namespace

Product LasProduct() {
  return {.name = "las",
          .description = "model.las, the surfels as LAS 1.4 in map coordinates",
          .add_options = &AddSurveyOptions,
          .write = [](const FinishedRun& run, const std::filesystem::path& folder) {
            return WriteModelFile(run, folder / "model.las", &WriteLas);
          }};
}

Product LocalPlyProduct() {
  return {.name = "ply",
          .description =
              "model_local.ply, the surfels in map coordinates less an offset that the "
              "header tells",
          .add_options = &AddSurveyOptions,
          .write = [](const FinishedRun& run, const std::filesystem::path& folder) {
            return WriteModelFile(run, folder / "model_local.ply", &WriteLocalPly);
          }};
}

}  // namespace mono3d::tools
