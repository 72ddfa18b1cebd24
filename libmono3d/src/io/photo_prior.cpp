// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/photo_prior.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "io/image_metadata.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Over the larger side: 136 degrees, where a pinhole camera ends, to 2 degrees.
constexpr double kMinFocal = 0.2;
constexpr double kMaxFocal = 30;

// The nominal focal length of a lens is rounded and holds for infinity: 3 to 4 % off on drones
// whose focal length was calibrated.
constexpr double kNominalFocalSigma = 0.04;
// As designed, of one camera: the maker's calibrations differ by 0.3 % (Phantom 4 RTK, Mavic 3E).
constexpr double kDesignFocalSigma = 0.01;

std::string FixedText(double number, int decimals) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, number);
  return buffer;
}

double LongSide(const CameraModel& camera) { return std::max(camera.width, camera.height); }

bool IsPlausibleFocal(double focal_px, double long_side) {
  return focal_px >= kMinFocal * long_side && focal_px <= kMaxFocal * long_side;
}

// "DJI FC300S, "
std::string CameraName(const PhotoFacts& facts) {
  if (!facts.exif) return {};
  const bool names_make = facts.exif->model.starts_with(facts.exif->make);
  std::string name = names_make || facts.exif->make.empty()
                         ? facts.exif->model
                         : facts.exif->make + " " + facts.exif->model;
  return name.empty() ? name : name + ", ";
}

struct PictureSize {
  int width = 0;
  int height = 0;
};

// Of the picture when EXIF was written: as the camera took it, or as a program left it that told
// EXIF of what it did.
PictureSize SizeByExif(const PhotoFacts& facts) {
  constexpr int kMin_px = 16;
  if (facts.exif && facts.exif->width >= kMin_px && facts.exif->height >= kMin_px) {
    return {facts.exif->width, facts.exif->height};
  }
  return {facts.width, facts.height};
}

// Of the picture that XMP was written for. Its designed optical centre is in the middle; where that
// is far from the middle of the size by EXIF, a program changed that size and left XMP alone.
PictureSize SizeByXmp(const PhotoFacts& facts) {
  constexpr double kMaxOffCentre = 0.05;  // of the size; designed centres are off by less than 1 %
  const PictureSize size = SizeByExif(facts);
  const double width = 2 * facts.xmp->design_centre_x;
  const double height = 2 * facts.xmp->design_centre_y;
  if (width == 0 || height == 0) return size;
  const bool is_same = std::abs(width / size.width - 1) < kMaxOffCentre &&
                       std::abs(height / size.height - 1) < kMaxOffCentre;
  if (is_same) return size;
  return {static_cast<int>(std::lround(width)), static_cast<int>(std::lround(height))};
}

// With the default's sigmas but those of the focal length.
CameraPrior PriorOfFocal(PictureSize size, double focal_px, double sigma) {
  CameraPrior prior = DefaultCameraPrior(size.width, size.height);
  prior.camera.fx = focal_px;
  prior.camera.fy = focal_px;
  prior.focal_sigma = sigma;
  return prior;
}

CameraPrior PriorOfDewarpData(const DjiDewarpData& data, PictureSize size) {
  const CameraModel camera{.width = size.width,
                           .height = size.height,
                           .fx = data.fx,
                           .fy = data.fy,
                           .cx = (size.width - 1) / 2. + data.offset_x,
                           .cy = (size.height - 1) / 2. + data.offset_y,
                           .distortion = data.distortion};
  return CalibratedCameraPrior(camera);
}

// Of a picture that the camera took the distortion out of. DJI does not say which focal length and
// principal point it gave it: they are between those measured and those designed.
CameraPrior PriorOfDewarpedPicture(const DjiXmp& xmp, PictureSize size) {
  const double focal_px = xmp.design_focal_px > 0 ? xmp.design_focal_px : xmp.dewarp->fx;
  CameraPrior prior = PriorOfFocal(size, focal_px, kDesignFocalSigma);
  prior.distortion_sigma = CalibratedCameraPrior(prior.camera).distortion_sigma;
  return prior;
}

std::optional<CameraPrior> PriorFromXmp(const PhotoFacts& facts) {
  if (!facts.xmp) return std::nullopt;
  const DjiXmp& xmp = *facts.xmp;
  if (!xmp.dewarp && xmp.design_focal_px == 0) return std::nullopt;
  const PictureSize size = SizeByXmp(facts);
  CameraPrior prior;
  if (xmp.is_dewarped) {
    prior = PriorOfDewarpedPicture(xmp, size);
    prior.description = "distortion taken out in the camera";
  } else if (xmp.dewarp) {
    prior = PriorOfDewarpData(*xmp.dewarp, size);
    prior.description = "calibrated by its maker";
    if (!xmp.dewarp->date.empty()) prior.description += " on " + xmp.dewarp->date;
  } else {
    prior = PriorOfFocal(size, xmp.design_focal_px, kDesignFocalSigma);
    prior.description = "focal length as designed";
  }
  prior.source = CameraPriorSource::kXmp;
  if (!IsPlausibleFocal(prior.camera.fx, LongSide(prior.camera))) return std::nullopt;
  return TransferToPicture(prior, facts.width, facts.height);
}

// The focal length over the larger side of the picture, from the lens and the pixels of the sensor;
// 0 where it is not told, or not of this picture: a program that resized it and told
// PixelXDimension of it, but not the resolution, makes the sensor small. Pixels of small sensors
// are small: no camera has a sensor below 1 inch (13 mm) with pixels above 3.5 um.
double FocalOfSensor(const ExifCamera& exif, PictureSize size) {
  constexpr double kMinSensorMm = 2;
  constexpr double kMaxSensorMm = 70;  // beyond medium format
  constexpr double kSmallSensorMm = 12;
  constexpr double kMaxSmallPixelsPerMm = 1 / 0.0036;
  if (exif.focal_mm == 0 || exif.pixels_per_mm == 0) return 0;
  const double sensor_mm = std::max(size.width, size.height) / exif.pixels_per_mm;
  if (sensor_mm < kMinSensorMm || sensor_mm > kMaxSensorMm) return 0;
  if (sensor_mm < kSmallSensorMm && exif.pixels_per_mm < kMaxSmallPixelsPerMm) return 0;
  return exif.digital_zoom * exif.focal_mm / sensor_mm;
}

std::optional<CameraPrior> PriorFromExif(const PhotoFacts& facts) {
  // Apart by more than this, the resolution of the sensor is not of this picture; the angle of view
  // in 35 mm film does not depend on its size.
  constexpr double kMaxDisagreement = 0.15;
  if (!facts.exif) return std::nullopt;
  const ExifCamera& exif = *facts.exif;
  const PictureSize size = SizeByExif(facts);
  const double long_side = std::max(size.width, size.height);
  RelativeFocal focal;
  std::string by;
  if (exif.focal_35mm > 0) {
    focal = FocalOf35mm(exif.focal_35mm, exif.focal_mm, size.width, size.height);
    // Cameras do not agree on whether it holds with the digital zoom or without.
    focal.sigma = std::hypot(focal.sigma, std::log(exif.digital_zoom) / 2);
    by = FixedText(exif.focal_35mm, 0) + " mm (35 mm equivalent)";
  }
  const double of_sensor = FocalOfSensor(exif, size);
  const bool disagrees =
      focal.value > 0 && std::abs(of_sensor / focal.value - 1) > kMaxDisagreement;
  if (of_sensor > 0 && !disagrees) {
    focal = {of_sensor, kNominalFocalSigma};
    by = FixedText(exif.focal_mm, 1) + " mm, pixels of " + FixedText(1000 / exif.pixels_per_mm, 2) +
         " um";
  }
  if (!IsPlausibleFocal(focal.value, 1)) return std::nullopt;
  CameraPrior prior = PriorOfFocal(size, focal.value * long_side, focal.sigma);
  prior.source = CameraPriorSource::kExif;
  prior.description = by;
  return TransferToPicture(prior, facts.width, facts.height);
}

bool HasFocalTags(const PhotoFacts& facts) {
  return facts.exif && (facts.exif->focal_35mm > 0 || facts.exif->pixels_per_mm > 0);
}

void WarnOfDamage(const PhotoFacts& facts) {
  const auto warn = [&](const char* what) { Log(LogLevel::kWarning, facts.name + ": " + what); };
  if (facts.has_damaged_xmp) warn("XMP is damaged and not used");
  if (facts.xmp && facts.xmp->has_absurd_value) warn("XMP has absurd values of the camera");
  if (facts.exif && facts.exif->is_damaged) warn("EXIF is damaged; what can be read is used");
}

}  // namespace

std::string PhotoFacts::Serial() const {
  if (exif && !exif->serial.empty()) return exif->serial;
  return xmp ? xmp->serial : std::string{};
}

PhotoFacts ReadPhotoFacts(const std::filesystem::path& photo) {
  ImageMetadata metadata = ReadImageMetadata(photo);
  PhotoFacts facts;
  facts.name = photo.filename().string();
  facts.width = metadata.width;
  facts.height = metadata.height;
  if (!metadata.exif.empty()) {
    facts.exif = ParseExif(metadata.exif);
    if (facts.width == 0) {  // TIFF
      facts.width = facts.exif->stored_width;
      facts.height = facts.exif->stored_height;
      metadata.xmp = std::move(facts.exif->xmp);
    }
  }
  if (!metadata.xmp.empty()) {
    facts.xmp = ParseDjiXmp(metadata.xmp);
    facts.has_damaged_xmp = !facts.xmp;
  }
  return facts;
}

std::optional<CameraPrior> PriorFromFacts(const PhotoFacts& facts) {
  // The maker's calibration and the nominal focal length of one camera agree to 10 %. Where they do
  // not, XMP is of another size than the picture, or of another zoom; angles survive resizing.
  constexpr double kMaxDisagreement = 0.3;
  WarnOfDamage(facts);
  std::optional<CameraPrior> prior = PriorFromXmp(facts);
  const std::optional<CameraPrior> exif_prior = PriorFromExif(facts);
  if (prior && exif_prior &&
      std::abs(std::log(prior->camera.fx / exif_prior->camera.fx)) > kMaxDisagreement) {
    Log(LogLevel::kWarning, facts.name + ": focal length " + FixedText(prior->camera.fx, 0) +
                                " px of XMP is not used, as EXIF says " +
                                FixedText(exif_prior->camera.fx, 0) + " px");
    prior.reset();
  }
  if (!prior && !exif_prior && HasFocalTags(facts)) {
    Log(LogLevel::kWarning, facts.name + ": EXIF has an absurd focal length");
  }
  if (!prior) prior = exif_prior;
  if (prior) prior->description = CameraName(facts) + prior->description;
  return prior;
}

RelativeFocal FocalOf35mm(double focal_35mm, double focal_mm, int width, int height) {
  constexpr double kFilmDiagonalMm = 43.27;  // of 36 mm x 24 mm
  constexpr double kSameShape = 0.02;        // sensors of 5280 x 3956 pixels are 4:3
  const double aspect =
      static_cast<double>(std::max(width, height)) / static_cast<double>(std::min(width, height));
  // The equivalent is of the diagonal (CIPA DCG-001). Makers state it of the whole sensor, and do
  // not change it for a picture that is a part of it. Sensors of phones, drones and compact cameras
  // (crop factor 3 and above), of Four Thirds (2) and medium format (below 0.9) are 4:3, the others
  // (35 mm film 1, APS-C 1.5, 1 inch 2.7) 3:2.
  double sensor_aspect = std::clamp(aspect, 4. / 3, 3. / 2);
  if (focal_mm > 0) {
    const double crop_factor = focal_35mm / focal_mm;
    const bool is_four_thirds = crop_factor > 1.8 && crop_factor < 2.2;
    sensor_aspect = is_four_thirds || crop_factor >= 3 || crop_factor < 0.9 ? 4. / 3 : 3. / 2;
  }
  const double by_picture = focal_35mm * std::hypot(1, 1 / aspect) / kFilmDiagonalMm;
  double by_sensor = focal_35mm * std::hypot(1, 1 / sensor_aspect) / kFilmDiagonalMm;
  const double rounding = 0.29 / focal_35mm;  // to whole mm: a uniform distribution
  const double sigma = std::hypot(kNominalFocalSigma, rounding);
  if (std::abs(aspect / sensor_aspect - 1) < kSameShape) return {by_picture, sigma};
  // A picture that is narrower than the sensor has its whole height: either that, or the shape of
  // the sensor is not what its crop factor says. A wider one has the whole width.
  const bool is_narrower = aspect < sensor_aspect;
  if (is_narrower) by_sensor *= sensor_aspect / aspect;
  const double value = is_narrower ? std::sqrt(by_sensor * by_picture) : by_sensor;
  return {value, std::hypot(sigma, std::log(by_sensor / by_picture) / 2)};
}

CameraPrior TransferToPicture(const CameraPrior& original, int width, int height) {
  CameraPrior prior = original;
  CameraModel& camera = prior.camera;
  const CameraPrior unknown = DefaultCameraPrior(width, height);
  if ((camera.width > camera.height) != (width > height) && width != height) {
    // To the left or to the right is not told: what has a direction is not known.
    std::swap(camera.width, camera.height);
    std::swap(camera.fx, camera.fy);
    camera.cx = (camera.width - 1) / 2.;
    camera.cy = (camera.height - 1) / 2.;
    camera.distortion[2] = camera.distortion[3] = 0;
    prior.distortion_sigma[2] = unknown.distortion_sigma[2];
    prior.distortion_sigma[3] = unknown.distortion_sigma[3];
    prior.principal_point_sigma_px =
        unknown.principal_point_sigma_px * LongSide(camera) / LongSide(unknown.camera);
  }
  const double scale_x = static_cast<double>(width) / camera.width;
  const double scale_y = static_cast<double>(height) / camera.height;
  const bool is_same_shape = std::abs(scale_x * camera.height - height) < 1 ||
                             std::abs(scale_y * camera.width - width) < 1;
  if (is_same_shape) return prior.Resized(width, height);

  // Cropped: on two sides at least, somewhere along the other direction.
  constexpr double kAroundSigma = 0.1;    // of the scale, where it was cropped on all sides perhaps
  constexpr double kUniformSigma = 0.29;  // of a uniform distribution of width 1
  const double scale = std::max(scale_x, scale_y);
  const double removed_x = camera.width * scale - width;
  const double removed_y = camera.height * scale - height;
  prior = prior.Resized(static_cast<int>(std::lround(camera.width * scale)),
                        static_cast<int>(std::lround(camera.height * scale)));
  camera.width = width;
  camera.height = height;
  camera.cx -= removed_x / 2;
  camera.cy -= removed_y / 2;
  prior.principal_point_sigma_px =
      std::hypot(prior.principal_point_sigma_px, kUniformSigma * std::max(removed_x, removed_y));
  // A camera crops its pictures to another shape itself, without resizing and in the middle.
  if (scale != 1) prior.focal_sigma = std::hypot(prior.focal_sigma, kAroundSigma);
  return prior;
}

}  // namespace mono3d
