// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/rasters.h"

#include <cstdio>
#include <memory>

#include "export/survey_options.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/products/orthophoto.h"
#include "mono3d/products/raster_file.h"
#include "mono3d/products/surface_model.h"

namespace mono3d::tools {
namespace {

struct RasterOptions {
  double gsd = 0;       // units of the map; 0: by the images
  double fill = 0;      // units of the map; 0: holes stay
  double contours = 0;  // units of the heights; 0: none
};

RasterOptions& RasterOptionsOfTool() {
  static RasterOptions options;
  return options;
}

void AddRasterOptions(CLI::App& app) {
  AddSurveyOptions(app);
  if (app.get_option_no_throw("--gsd") != nullptr) return;
  RasterOptions& options = RasterOptionsOfTool();
  app.add_option("--gsd", options.gsd,
                 "edge of the cells of dsm and orthophoto, in metres (feet where --crs has them); "
                 "left out: what a pixel of the images shows of the ground")
      ->check(CLI::PositiveNumber);
  app.add_option("--fill", options.fill,
                 "holes of dsm and orthophoto are filled by heights at most so far away, metres")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--contours", options.contours,
                 "dsm: lines of equal height as well, so many metres apart, contours.gpkg")
      ->check(CLI::PositiveNumber);
}

// Of the surface model or of the orthophoto.
double CellOf(const FinishedRun& run, const MapAxes& axes, const MapSurfels& surfels,
              bool of_depth_maps) {
  if (RasterOptionsOfTool().gsd > 0) return RasterOptionsOfTool().gsd;
  double distance = GroundSampleDistance(run, of_depth_maps);
  // A run without sparse/: neighbouring surfels are a pixel apart, and so are their radii.
  if (distance == 0) distance = surfels.median_radius();
  if (!(distance > 0)) {
    throw Error(ErrorParts{.what = "the run does not tell how large the cells should be",
                           .where = run.folder.string(),
                           .expected = "images in sparse/, surfels with a radius, or --gsd",
                           .found = "none"});
  }
  return RoundedCell(distance / axes.ModelUnitsPerUnit());
}

std::unique_ptr<RasterFile> MakeHeights(MapSurfels& surfels, const MapAxes& axes, double cell,
                                        const std::filesystem::path& file) {
  const RasterGrid grid = GridOver(surfels.BoundsOfMost(), cell);
  auto heights = std::make_unique<RasterFile>(file, grid, axes, RasterForm::kHeights);
  MakeSurfaceModel(surfels, axes, grid, [&](const cv::Rect& place, const cv::Mat& cells) {
    heights->Write(place, cells);
  });
  if (RasterOptionsOfTool().fill > 0) heights->Fill(RasterOptionsOfTool().fill / cell);
  return heights;
}

void TellOfGrid(const char* what, const RasterGrid& grid) {
  std::printf("%s: %d x %d cells of %g\n", what, grid.width, grid.height, grid.cell);
}

std::vector<std::filesystem::path> WriteSurfaceModel(const FinishedRun& run,
                                                     const std::filesystem::path& folder) {
  const MapAxes axes = TellAxes(run);
  MapSurfels surfels(run.model, axes);
  const double cell = CellOf(run, axes, surfels, true);
  std::vector<std::filesystem::path> files = {folder / "dsm.tif"};
  const auto heights = MakeHeights(surfels, axes, cell, files[0]);
  heights->Finish();
  TellOfGrid("dsm", heights->grid());
  if (RasterOptionsOfTool().contours > 0) {
    files.push_back(folder / "contours.gpkg");
    heights->WriteContours(files.back(), RasterOptionsOfTool().contours);
  }
  return files;
}

void TellOfMissing(const std::vector<std::string>& names) {
  if (names.empty()) return;
  Log(LogLevel::kWarning, "the orthophoto is made without " + std::to_string(names.size()) +
                              " images that are not there, or not of the size of their camera: " +
                              names[0] + (names.size() > 1 ? ", ..." : ""));
}

std::vector<std::filesystem::path> WriteOrthophoto(const FinishedRun& run,
                                                   const std::filesystem::path& folder) {
  const MapAxes axes = TellAxes(run);
  MapSurfels surfels(run.model, axes);
  const std::filesystem::path file = folder / "orthophoto.tif";
  const auto heights =
      MakeHeights(surfels, axes, CellOf(run, axes, surfels, true), folder / "orthophoto.heights");
  const HeightSource source = {.grid = heights->grid(),
                               .read = [&](const cv::Rect& place) { return heights->Read(place); }};
  const RasterGrid grid = GridOver(surfels.BoundsOfMost(), CellOf(run, axes, surfels, false));
  RasterFile picture(file, grid, axes, RasterForm::kPicture);
  const OrthophotoReport report = MakeOrthophoto(
      run, axes, source, grid,
      [&](const cv::Rect& place, const cv::Mat& cells) { picture.Write(place, cells); });
  picture.Finish();
  TellOfMissing(report.missing_images);
  TellOfGrid("orthophoto", grid);
  return {file};
}

}  // namespace

Product OrthophotoProduct() {
  return {.name = "orthophoto",
          .description = "orthophoto.tif, the images as a map (a rolling shutter is not modelled)",
          .add_options = &AddRasterOptions,
          .write = &WriteOrthophoto};
}

Product SurfaceModelProduct() {
  return {.name = "dsm",
          .description = "dsm.tif, the heights of what is seen from above as GeoTIFF",
          .add_options = &AddRasterOptions,
          .write = &WriteSurfaceModel};
}

}  // namespace mono3d::tools
