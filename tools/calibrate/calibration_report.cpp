// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibrate/calibration_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "common/camera_choice.h"
#include "common/json_file.h"
#include "drawing/residual_picture.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

std::string Plain(double value, int num_digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", num_digits, value);
  return text;
}

// As many digits as tell the two leading ones of the standard deviation.
std::string WithSigma(double value, double sigma) {
  constexpr int kMaxDigits = 8;
  const int num_digits =
      sigma > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, kMaxDigits)
                : kMaxDigits / 2;
  return Plain(value, num_digits) + (sigma > 0 ? " +- " + Plain(sigma, num_digits) : " held");
}

std::string Line(const std::string& name, const std::string& values, bool is_determined) {
  std::string line = name;
  constexpr std::size_t kColumn = 18;
  line.resize(std::max(kColumn, line.size() + 1), ' ');
  return line + values + (is_determined ? "\n" : " (not determined by the images)\n");
}

double AspectSigma(const CameraPrior& camera) {
  return camera.camera.fy / camera.camera.fx * camera.aspect_sigma;
}

double RootMeanSquare_px(const std::vector<CalibrationResidual>& residuals) {
  if (residuals.empty()) return 0;
  double sum = 0;
  for (const CalibrationResidual& residual : residuals) sum += residual.error_px.squaredNorm();
  return std::sqrt(sum / (2 * static_cast<double>(residuals.size())));
}

std::string DistortionLines(const CameraCalibration& calibration) {
  const CameraPrior& camera = calibration.posterior;
  std::string lines;
  const std::vector<std::string> all_names = DistortionNames(camera.camera.lens);
  std::vector<std::vector<std::size_t>> groups = {{0}, {1}, {4}, {2, 3}};
  if (camera.camera.lens == LensModel::kFisheye) groups = {{0}, {1}, {2}, {3}};
  for (const std::vector<std::size_t>& group : groups) {
    std::string names;
    std::string values;
    bool is_determined = true;
    for (const std::size_t i : group) {
      const char* separator = names.empty() ? "" : ", ";
      names += separator + all_names[i];
      values += separator + WithSigma(camera.camera.distortion[i], camera.distortion_sigma[i]);
      is_determined = is_determined && calibration.determines_distortion[i];
    }
    lines += Line("distortion " + names, values, is_determined);
  }
  return lines;
}

nlohmann::json Parameter(double value, double sigma, double prior, double prior_sigma,
                         bool is_determined) {
  return {{"value", value},
          {"sigma", sigma},
          {"prior", prior},
          {"prior_sigma", prior_sigma},
          {"determined", is_determined}};
}

nlohmann::json ParametersJson(const CameraCalibration& calibration) {
  const CameraPrior& prior = calibration.prior;
  const CameraPrior& found = calibration.posterior;
  nlohmann::json json;
  json["fx"] = Parameter(found.camera.fx, found.camera.fx * found.focal_sigma, prior.camera.fx,
                         prior.camera.fx * prior.focal_sigma, calibration.determines_focal_length);
  json["fy_by_fx"] = Parameter(found.camera.fy / found.camera.fx, AspectSigma(found),
                               prior.camera.fy / prior.camera.fx, AspectSigma(prior),
                               calibration.determines_aspect);
  const auto principal_point = [&](double value, double before) {
    return Parameter(value, found.principal_point_sigma_px, before, prior.principal_point_sigma_px,
                     calibration.determines_principal_point);
  };
  json["cx"] = principal_point(found.camera.cx, prior.camera.cx);
  json["cy"] = principal_point(found.camera.cy, prior.camera.cy);
  const std::vector<std::string> names = DistortionNames(found.camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    json[names[i]] =
        Parameter(found.camera.distortion[i], found.distortion_sigma[i], prior.camera.distortion[i],
                  prior.distortion_sigma[i], calibration.determines_distortion[i]);
  }
  json["readout_s"] = Parameter(found.camera.shutter.readout_s, found.readout_sigma_s,
                                prior.camera.shutter.readout_s, prior.readout_sigma_s,
                                calibration.determines_readout);
  json["readout_s"]["by_columns"] = found.camera.shutter.reads_columns;
  return json;
}

void WritePicture(const std::filesystem::path& path, const cv::Mat& picture) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  WriteFileAtomically(path, std::string(bytes.begin(), bytes.end()));
}

}  // namespace

bool AgreesWithCalibration(const CameraCalibration& calibration) {
  return !calibration.is_learned && calibration.num_rounds > 0 &&
         calibration.prior.source == CameraPriorSource::kCalibration;
}

std::string CalibrationText(const CameraCalibration& calibration) {
  const CameraPrior& prior = calibration.prior;
  const CameraPrior& found = calibration.posterior;
  const CameraModel& camera = found.camera;
  std::string text;
  text += Line("focal length",
               WithSigma(camera.fx, camera.fx * found.focal_sigma) + " px (was " +
                   Plain(prior.camera.fx, 1) + " from " + ToString(prior.source) + ")",
               calibration.determines_focal_length);
  // Nothing to say of pixels that are square beyond doubt.
  if (found.aspect_sigma > 0) {
    text += Line("fy / fx", WithSigma(camera.fy / camera.fx, AspectSigma(found)),
                 calibration.determines_aspect);
  }
  text += Line("principal point",
               WithSigma(camera.cx, found.principal_point_sigma_px) + ", " +
                   WithSigma(camera.cy, found.principal_point_sigma_px) + " px",
               calibration.determines_principal_point);
  text += DistortionLines(calibration);
  if (found.readout_sigma_s > 0) {
    const char* lines = camera.shutter.reads_columns ? " ms, by columns" : " ms, by rows";
    text += Line("readout time",
                 WithSigma(1e3 * camera.shutter.readout_s, 1e3 * found.readout_sigma_s) + lines,
                 calibration.determines_readout);
  }
  text += Line("a ray is known to",
               Plain(calibration.uncertainty_px, 2) + " px where it is known worst; differs by " +
                   Plain(calibration.change_px, 2) + " px from before",
               true);
  text += Line("residuals",
               Plain(calibration.sigma_px, 3) + " px (robust standard deviation) of " +
                   std::to_string(calibration.residuals.size()) + " observations in " +
                   std::to_string(calibration.num_images) + " images",
               true);
  const std::string variation = VariationText(calibration.variation);
  if (!variation.empty()) text += variation + "\n";
  if (!calibration.reason.empty()) text += calibration.reason + "\n";
  if (calibration.contradicts_prior) {
    text += "the images contradict what was known of the camera before\n";
  }
  return text;
}

nlohmann::json CalibrationJson(const CameraCalibration& calibration) {
  const CameraModel& camera = calibration.posterior.camera;
  nlohmann::json json;
  json["image_size"] = {camera.width, camera.height};
  json["lens"] = ToString(camera.lens);
  json["learned"] = calibration.is_learned;
  if (!calibration.reason.empty()) json["reason"] = calibration.reason;
  json["prior"] = {{"source", ToString(calibration.prior.source)},
                   {"description", calibration.prior.description},
                   {"contradicted", calibration.contradicts_prior}};
  json["description"] = calibration.posterior.description;
  json["parameters"] = ParametersJson(calibration);
  json["change_px"] = calibration.change_px;
  json["uncertainty_px"] = calibration.uncertainty_px;
  json["sigma_px"] = calibration.sigma_px;
  json["principal_point_variation_px"] = calibration.variation.principal_point_px;
  json["focal_variation"] = calibration.variation.focal_share;
  json["focal_drift"] = calibration.variation.focal_drift;
  json["rms_px"] = RootMeanSquare_px(calibration.residuals);
  json["rounds"] = calibration.num_rounds;
  json["images"] = calibration.num_images;
  json["points"] = calibration.num_points;
  json["observations"] = calibration.residuals.size();
  return json;
}

void WriteCalibrationReport(const std::filesystem::path& folder,
                            const CameraCalibration& calibration) {
  CreateOutputFolder(folder);
  const CameraModel& camera = calibration.posterior.camera;
  WriteFileAtomically(folder / "calibration.json", JsonText(CalibrationJson(calibration)));
  WritePicture(folder / "residuals.png", ResidualFieldPicture(calibration.residuals, camera));
  WritePicture(folder / "residuals_by_radius.png",
               ResidualByRadiusPicture(calibration.residuals, camera));
}

}  // namespace mono3d::tools
