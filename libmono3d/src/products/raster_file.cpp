// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/raster_file.h"

#include <cmath>
#include <string>
#include <system_error>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/products/surface_model.h"

#ifdef MONO3D_HAS_GDAL
#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <gdal.h>
#include <gdal_alg.h>
#include <ogr_api.h>
#include <ogr_srs_api.h>
#endif

namespace mono3d {

#ifdef MONO3D_HAS_GDAL

namespace {

// GDAL prints its errors; here the last one is kept. Nor does it write .aux.xml files beside.
class QuietGdal {
 public:
  QuietGdal() {
    CPLPushErrorHandlerEx(
        [](CPLErr kind, CPLErrorNum, const char* message) {
          if (kind >= CE_Failure) {
            static_cast<QuietGdal*>(CPLGetErrorHandlerUserData())->message_ = message;
          }
        },
        this);
    CPLSetThreadLocalConfigOption("GDAL_PAM_ENABLED", "NO");
    CPLErrorReset();
    [[maybe_unused]] static const bool is_registered = [] {
      GDALAllRegister();
      return true;
    }();
  }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;

  [[noreturn]] void Throw(const char* what, const std::filesystem::path& where) const {
    throw Error(ErrorParts{.what = what,
                           .where = where.string(),
                           .expected = {},
                           .found = message_,
                           .code = ErrorCode::kIo});
  }

 private:
  std::string message_;
};

struct DatasetCloser {
  void operator()(GDALDatasetH dataset) const { GDALClose(dataset); }
};
using DatasetPtr = std::unique_ptr<void, DatasetCloser>;

// Options of GDAL, "NAME=VALUE".
class GdalOptions {
 public:
  GdalOptions(std::initializer_list<const char*> options) {
    for (const char* option : options) list_ = CSLAddString(list_, option);
  }
  ~GdalOptions() { CSLDestroy(list_); }
  GdalOptions(const GdalOptions&) = delete;
  GdalOptions& operator=(const GdalOptions&) = delete;
  char** get() const { return list_; }

 private:
  char** list_ = nullptr;
};

std::filesystem::path Beside(const std::filesystem::path& path, const char* ending) {
  std::filesystem::path beside = path;
  beside += ending;
  return beside;
}

int NumBands(RasterForm form) { return form == RasterForm::kHeights ? 1 : 4; }

struct SpatialReferenceReleaser {
  void operator()(OGRSpatialReferenceH reference) const { OSRRelease(reference); }
};

}  // namespace

struct RasterFile::Dataset {
  std::filesystem::path file;  // beside
  DatasetPtr handle;

  ~Dataset() {
    const QuietGdal quiet;
    handle.reset();
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }

  // The same for both directions: GDAL's function takes which one.
  void Transfer(GDALRWFlag direction, const cv::Rect& place, const cv::Mat& cells,
                RasterForm form) const {
    const QuietGdal quiet;
    const bool is_picture = form == RasterForm::kPicture;
    const CPLErr result = GDALDatasetRasterIO(
        handle.get(), direction, place.x, place.y, place.width, place.height, cells.data,
        place.width, place.height, is_picture ? GDT_Byte : GDT_Float32, NumBands(form), nullptr,
        is_picture ? 4 : 4, static_cast<int>(cells.step[0]), is_picture ? 1 : 0);
    if (result != CE_None) {
      quiet.Throw(direction == GF_Write ? "cannot write the raster" : "cannot read the raster",
                  file);
    }
  }
};

bool RasterFile::IsSupported() { return true; }

RasterFile::RasterFile(std::filesystem::path path, const RasterGrid& grid, const MapAxes& axes,
                       RasterForm form)
    : path_(std::move(path)), grid_(grid), form_(form), dataset_(std::make_unique<Dataset>()) {
  const QuietGdal quiet;
  dataset_->file = Beside(path_, ".cells.partial");
  const bool is_picture = form == RasterForm::kPicture;
  // Not compressed: parts are written more than once.
  const GdalOptions options({"TILED=YES", "BIGTIFF=IF_SAFER", "SPARSE_OK=TRUE",
                             is_picture ? "PHOTOMETRIC=RGB" : "PHOTOMETRIC=MINISBLACK",
                             is_picture ? "ALPHA=NON-PREMULTIPLIED" : "ALPHA=NO"});
  dataset_->handle.reset(GDALCreate(GDALGetDriverByName("GTiff"), dataset_->file.c_str(),
                                    grid.width, grid.height, NumBands(form),
                                    is_picture ? GDT_Byte : GDT_Float32, options.get()));
  if (!dataset_->handle) quiet.Throw("cannot create the raster", path_);
  double transform[] = {grid.west, grid.cell, 0, grid.north, 0, -grid.cell};
  GDALSetGeoTransform(dataset_->handle.get(), transform);
  if (axes.system() != nullptr) {
    GDALSetProjection(dataset_->handle.get(), axes.system()->wkt2().c_str());
  }
  if (!is_picture) {
    const GDALRasterBandH band = GDALGetRasterBand(dataset_->handle.get(), 1);
    GDALSetRasterNoDataValue(band, kNoHeight);
    GDALSetDescription(band, "height");
    GDALFillRaster(band, kNoHeight, 0);
  }
}

RasterFile::~RasterFile() = default;

void RasterFile::Write(const cv::Rect& place, const cv::Mat& cells) {
  dataset_->Transfer(GF_Write, place, cells, form_);
}

cv::Mat RasterFile::Read(const cv::Rect& place) const {
  cv::Mat cells(place.height, place.width, form_ == RasterForm::kHeights ? CV_32FC1 : CV_8UC4);
  dataset_->Transfer(GF_Read, place, cells, form_);
  return cells;
}

void RasterFile::Fill(double max_distance_cells) {
  const QuietGdal quiet;
  const GDALRasterBandH band = GDALGetRasterBand(dataset_->handle.get(), 1);
  const GdalOptions options({"TEMP_FILE_DRIVER=GTiff"});
  if (GDALFillNodata(band, nullptr, max_distance_cells, 0, 0, options.get(), nullptr, nullptr) !=
      CE_None) {
    quiet.Throw("cannot fill the holes", path_);
  }
}

void RasterFile::Finish() {
  const QuietGdal quiet;
  const std::filesystem::path partial = Beside(path_, ".partial");
  const GdalOptions options({"COMPRESS=DEFLATE", "PREDICTOR=YES", "BIGTIFF=IF_SAFER",
                             "OVERVIEW_RESAMPLING=AVERAGE", "NUM_THREADS=ALL_CPUS"});
  GDALFlushCache(dataset_->handle.get());
  const DatasetPtr copy(GDALCreateCopy(GDALGetDriverByName("COG"), partial.c_str(),
                                       dataset_->handle.get(), FALSE, options.get(), nullptr,
                                       nullptr));
  if (!copy) quiet.Throw("cannot write the raster", path_);
  std::error_code error;
  std::filesystem::rename(partial, path_, error);
  if (error) quiet.Throw("cannot name the raster", path_);
}

void RasterFile::WriteContours(const std::filesystem::path& path, double interval) const {
  const QuietGdal quiet;
  const GDALRasterBandH band = GDALGetRasterBand(dataset_->handle.get(), 1);
  // GDAL takes the form by the ending.
  std::filesystem::path partial = path;
  partial.replace_filename(path.stem().string() + ".partial" + path.extension().string());
  std::error_code error;
  std::filesystem::remove(partial, error);
  {
    const DatasetPtr lines(
        GDALCreate(GDALGetDriverByName("GPKG"), partial.c_str(), 0, 0, 0, GDT_Unknown, nullptr));
    if (!lines) quiet.Throw("cannot create the contours", path);
    const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset_->handle.get());
    const OGRLayerH layer =
        GDALDatasetCreateLayer(lines.get(), "contours", reference, wkbLineString, nullptr);
    if (layer == nullptr) quiet.Throw("cannot create the contours", path);
    for (const auto& [name, type] : {std::pair("id", OFTInteger), std::pair("height", OFTReal)}) {
      const OGRFieldDefnH field = OGR_Fld_Create(name, type);
      OGR_L_CreateField(layer, field, TRUE);
      OGR_Fld_Destroy(field);
    }
    const std::string step = "LEVEL_INTERVAL=" + std::to_string(interval);
    const std::string none = "NODATA=" + std::to_string(kNoHeight);
    const OGRFeatureDefnH definition = OGR_L_GetLayerDefn(layer);
    const std::string id = "ID_FIELD=" + std::to_string(OGR_FD_GetFieldIndex(definition, "id"));
    const std::string height =
        "ELEV_FIELD=" + std::to_string(OGR_FD_GetFieldIndex(definition, "height"));
    const GdalOptions options({step.c_str(), none.c_str(), id.c_str(), height.c_str()});
    // Each line on its own would be synchronised with the disk.
    GDALDatasetStartTransaction(lines.get(), FALSE);
    const CPLErr result = GDALContourGenerateEx(band, layer, options.get(), nullptr, nullptr);
    GDALDatasetCommitTransaction(lines.get());
    if (result != CE_None) quiet.Throw("cannot draw the contours", path);
  }
  std::filesystem::rename(partial, path, error);
  if (error) quiet.Throw("cannot name the contours", path);
}

#else

struct RasterFile::Dataset {};

bool RasterFile::IsSupported() { return false; }

RasterFile::RasterFile(std::filesystem::path path, const RasterGrid& grid, const MapAxes& /*axes*/,
                       RasterForm form)
    : path_(std::move(path)), grid_(grid), form_(form) {
  throw Error(ErrorParts{.what = "GeoTIFF files need GDAL",
                         .where = path_.string(),
                         .expected = "a mono3d that was built with libgdal-dev",
                         .found = "one without",
                         .code = ErrorCode::kUnsupported});
}
RasterFile::~RasterFile() = default;
void RasterFile::Write(const cv::Rect& /*place*/, const cv::Mat& /*cells*/) {}
cv::Mat RasterFile::Read(const cv::Rect& /*place*/) const { return {}; }
void RasterFile::Fill(double /*max_distance_cells*/) {}
void RasterFile::Finish() {}
void RasterFile::WriteContours(const std::filesystem::path& /*path*/, double /*interval*/) const {}

#endif

}  // namespace mono3d
