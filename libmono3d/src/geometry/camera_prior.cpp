// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/camera_prior.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

// Of the larger side of the image: 58 degrees across it, in the middle of drones (70 to 84 degrees,
// 0.71 to 0.55), action cameras and phones (0.75 to 0.8), and zoom lenses (0.7 to 2). With 30 %,
// two standard deviations reach from 0.36 (108 degrees, where a pinhole camera ends) to 1.44.
constexpr double kDefaultFocal = 0.9;
constexpr double kDefaultFocalSigma = 0.3;
// Of the larger side. Measured calibrations of drones, phones and lenses for system cameras have
// their principal point within 0.5 % of the middle; stabilised lenses and sensors move by more.
constexpr double kDefaultPrincipalPointSigma = 0.01;
// k1 of lenses that are corrected in the camera, as phones and most drones do it, is within 0.05;
// uncorrected ones of 84 degrees have -0.11 (4/3 inch) to -0.27 (1 inch), with k2 of 0.015 to 0.11
// and k3 of -0.03. p1 and p2 of the same are below 1e-3; 1e-3 moves a corner of those by 2 px in
// 1000.
constexpr std::array<double, 5> kDefaultDistortionSigma = {0.12, 0.1, 1e-3, 1e-3, 0.05};

// Of the larger side of the image of a fisheye lens whose radius is the angle: 130 degrees across
// it, between action cameras (118 to 125), racing drones (125 to 150) and cameras for machine
// vision (150 to 190). With 30 %, two standard deviations reach from 71 to 237 degrees.
constexpr double kDefaultFisheyeFocal = 1 / (130 * std::numbers::pi / 180);
// The projections that lenses are designed for have k1 from -0.042 (equal solid angles) over 0
// (equal angles) to 0.083 (stereographic), k2 from 0.0005 to 0.008, and k3 and k4 below 0.001.
// Calibrations of real ones have larger ones, to 0.05, of alternating signs that make curves like
// those together. Alone these move a ray at 60 degrees by 7, 2.5, 1.4 and 0.5 % of the focal
// length.
constexpr std::array<double, 5> kDefaultFisheyeSigma = {0.06, 0.02, 0.01, 0.003, 0};

// A calibration from a chessboard or from an adjustment is repeated to 0.1 to 0.3 %. Refocusing,
// zoom lenses set by hand and temperature change a focal length by more: 1 %.
constexpr double kCalibratedFocalSigma = 0.01;
// Calibrations disagree in fy / fx by a tenth of their disagreement in the focal length.
constexpr double kCalibratedAspectSigma = 0.001;
// Of the larger side: what a calibration is wrong by in the corners beside its focal length, for
// the principal point and for each distortion coefficient alone. 1.5 px in 1000.
constexpr double kCalibratedCornerError = 0.0015;

// Readout of drones, phones and action cameras takes 8 to 33 ms; most lenses for surveys are in
// front of a mechanical or global shutter. Two standard deviations reach over all of them, in
// either direction.
constexpr double kDefaultReadoutSigma_s = 0.02;
// Readout times that somebody measured are given in whole milliseconds.
constexpr double kToldReadoutSigma_s = 0.001;

double LargerSide(const CameraModel& camera) { return std::max(camera.width, camera.height); }

std::array<double, 5> DefaultDistortionSigma(LensModel lens) {
  return lens == LensModel::kFisheye ? kDefaultFisheyeSigma : kDefaultDistortionSigma;
}

// Where each coefficient alone moves a corner at radius r (at z = 1) by `error`.
std::array<double, 5> BrownSigma(double r, double error) {
  const double tangential = error / (3 * r * r);  // the most a tangential term does at radius r
  return {error / std::pow(r, 3), error / std::pow(r, 5), tangential, tangential,
          error / std::pow(r, 7)};
}

// The same of a corner with the radius r in focal lengths.
std::array<double, 5> FisheyeSigma(const CameraModel& camera, double r, double error) {
  const FisheyeAngles angles(camera.distortion);
  const double theta = angles.At(r).value_or(angles.largest());
  return {error / std::pow(theta, 3), error / std::pow(theta, 5), error / std::pow(theta, 7),
          error / std::pow(theta, 9), 0};
}

// The standard deviation of each distortion coefficient that moves the farthest corner by
// `corner_error_px`, and no more than that of an unknown lens: where the view is narrow, its corner
// says next to nothing of the higher terms.
std::array<double, 5> DistortionSigmaOfCorner(const CameraModel& camera, double corner_error_px) {
  const double x = std::max(camera.cx, camera.width - 1 - camera.cx) / camera.fx;
  const double y = std::max(camera.cy, camera.height - 1 - camera.cy) / camera.fy;
  const double r = std::hypot(x, y);
  const double error = corner_error_px / std::max(camera.fx, camera.fy);
  const std::array<double, 5> most = DefaultDistortionSigma(camera.lens);
  std::array<double, 5> sigma =
      camera.lens == LensModel::kFisheye ? FisheyeSigma(camera, r, error) : BrownSigma(r, error);
  for (std::size_t i = 0; i < sigma.size(); ++i) sigma[i] = std::min(sigma[i], most[i]);
  return sigma;
}

}  // namespace

const char* ToString(CameraPriorSource source) {
  switch (source) {
    case CameraPriorSource::kCalibration:
      return "calibration";
    case CameraPriorSource::kXmp:
      return "XMP";
    case CameraPriorSource::kExif:
      return "EXIF";
    case CameraPriorSource::kVideo:
      return "video";
    case CameraPriorSource::kDefault:
      return "default";
  }
  return "unknown";
}

CameraPrior CameraPrior::Resized(int new_width, int new_height) const {
  CameraPrior resized = *this;
  resized.camera = camera.Resized(new_width, new_height);
  resized.principal_point_sigma_px *= LargerSide(resized.camera) / LargerSide(camera);
  return resized;
}

void Validate(const CameraPrior& prior, const std::string& where) {
  Validate(prior.camera, where);
  const auto require = [&](const char* name, double sigma) {
    if (std::isfinite(sigma) && sigma >= 0) return;
    throw Error(ErrorParts{.what = std::string("camera prior: bad standard deviation of ") + name,
                           .where = where,
                           .expected = "0 or more",
                           .found = std::to_string(sigma)});
  };
  require("the focal length", prior.focal_sigma);
  require("fy / fx", prior.aspect_sigma);
  require("the principal point", prior.principal_point_sigma_px);
  for (const double sigma : prior.distortion_sigma) require("the distortion", sigma);
  require("the readout time", prior.readout_sigma_s);
}

CameraPrior DefaultCameraPrior(int width, int height, LensModel lens) {
  CameraPrior prior;
  const bool is_fisheye = lens == LensModel::kFisheye;
  const double focal_px =
      (is_fisheye ? kDefaultFisheyeFocal : kDefaultFocal) * std::max(width, height);
  prior.camera = {.width = width,
                  .height = height,
                  .fx = focal_px,
                  .fy = focal_px,
                  .cx = (width - 1) / 2.,
                  .cy = (height - 1) / 2.,
                  .lens = lens};
  Validate(prior.camera, "default camera");
  prior.focal_sigma = kDefaultFocalSigma;
  prior.principal_point_sigma_px = kDefaultPrincipalPointSigma * LargerSide(prior.camera);
  prior.distortion_sigma = DefaultDistortionSigma(lens);
  prior.readout_sigma_s = kDefaultReadoutSigma_s;
  prior.description = is_fisheye ? "a fisheye lens of 130 degrees across the larger side"
                                 : "0.9 of the larger side of the images";
  return prior;
}

CameraPrior CalibratedCameraPrior(const CameraModel& camera) {
  Validate(camera, "calibrated camera");
  CameraPrior prior;
  prior.camera = camera;
  prior.focal_sigma = kCalibratedFocalSigma;
  // Where they are one number, the calibration took pixels for square.
  prior.aspect_sigma = camera.fx == camera.fy ? 0 : kCalibratedAspectSigma;
  prior.principal_point_sigma_px = kCalibratedCornerError * LargerSide(camera);
  prior.distortion_sigma = DistortionSigmaOfCorner(camera, prior.principal_point_sigma_px);
  // Most calibrations say nothing of the shutter.
  prior.readout_sigma_s = camera.shutter.IsGlobal() ? kDefaultReadoutSigma_s : kToldReadoutSigma_s;
  prior.source = CameraPriorSource::kCalibration;
  prior.description = "calibration";
  return prior;
}

}  // namespace mono3d
