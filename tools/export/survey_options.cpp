// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/survey_options.h"

#include <cstdio>
#include <filesystem>
#include <utility>

namespace mono3d::tools {

SurveyOptions& SurveyOptionsOfTool() {
  static SurveyOptions options;
  return options;
}

void AddSurveyOptions(CLI::App& app) {
  if (app.get_option_no_throw("--crs") != nullptr) return;
  app.add_option(
      "--crs", SurveyOptionsOfTool().crs,
      "coordinate system of las, ply, dsm, orthophoto and contours, such as EPSG:25832 or "
      "EPSG:25832+7837; left out: the UTM zone of the run's origin, WGS 84");
}

MapAxes TellAxes(const FinishedRun& run) {
  static std::filesystem::path told;
  MapAxes axes = AxesOfProducts(run, SurveyOptionsOfTool().crs);
  if (std::exchange(told, run.folder) != run.folder) {
    std::printf("%s\n", AxesLine(run, axes).c_str());
  }
  return axes;
}

}  // namespace mono3d::tools
