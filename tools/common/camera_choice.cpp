// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/camera_choice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/camera_metadata.h"

namespace mono3d::tools {
namespace {

std::string Fixed(double value, int num_digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", num_digits, value);
  return text;
}

std::string FocalLength(const CameraPrior& camera) {
  return "focal length " + Fixed(camera.camera.fx, 1) + " +- " +
         Fixed(camera.camera.fx * camera.focal_sigma, 1) + " px";
}

// "rolling shutter of 30.1 +- 0.2 ms, from the top"
std::string ShutterText(const CameraPrior& camera) {
  const RollingShutter& shutter = camera.camera.shutter;
  const bool is_forward = shutter.readout_s > 0;
  const char* from = shutter.reads_columns ? (is_forward ? "from the left" : "from the right")
                                           : (is_forward ? "from the top" : "from the bottom");
  return "rolling shutter of " + Fixed(1e3 * std::abs(shutter.readout_s), 1) + " +- " +
         Fixed(1e3 * camera.readout_sigma_s, 1) + " ms, " + from;
}

}  // namespace

void AddLensOption(CLI::App& app, CameraArguments& arguments) {
  const std::vector<std::string> names = {kAutomaticLens, ToString(LensModel::kBrown),
                                          ToString(LensModel::kFisheye)};
  app.add_option("--lens", arguments.lens,
                 "fisheye: of action cameras and racing drones, from about 110 degrees across the "
                 "image on; auto: that of --camera, or pinhole")
      ->check(CLI::Validator(
          [names](const std::string& text) {
            const bool is_known = std::ranges::find(names, text) != names.end();
            return is_known ? std::string()
                            : "expected " + names[0] + ", " + names[1] + " or " + names[2] +
                                  ", found " + text;
          },
          "{" + names[0] + "," + names[1] + "," + names[2] + "}"))
      ->capture_default_str();
}

CameraPrior FindPrior(const std::string& input, const CameraArguments& arguments) {
  if (!arguments.file.empty()) {
    const CameraModel camera = ReadCameraFile(arguments.file);
    if (arguments.lens != kAutomaticLens && arguments.lens != ToString(camera.lens)) {
      throw UsageError(ErrorParts{.what = "the calibration is of another lens",
                                  .where = arguments.file,
                                  .expected = arguments.lens,
                                  .found = ToString(camera.lens)});
    }
    return CalibratedCameraPrior(camera);
  }
  CameraPrior prior = ReadCameraPrior(input);
  if (arguments.lens != ToString(LensModel::kFisheye)) return prior;
  return DefaultCameraPrior(prior.camera.width, prior.camera.height, LensModel::kFisheye);
}

int TellOfTurn(const std::string& input) {
  const int turn_deg = ReadShownTurn(input);
  if (turn_deg != 0) {
    std::printf(
        "the images are marked as turned by %d degrees: pixels, --camera and all results are of "
        "the images as they are stored, not turned\n",
        turn_deg);
  }
  return turn_deg;
}

FootageOpener OpenerOf(const std::string& input, const FrameSourceOptions& source) {
  return [input, source](const CameraModel& camera, int start, int max_frames) {
    FrameSourceOptions part = source;
    part.start += start * std::max(1, source.stride);
    part.seeks = start > 0;  // any part of the footage will do
    if (max_frames > 0) {
      // Never past the frames that the run itself will see.
      const int left = source.max_frames > 0 ? source.max_frames - start : max_frames;
      part.max_frames = std::max(1, std::min(max_frames, left));
    }
    return OpenFrameSource(input, camera, part);
  };
}

CameraChoice ChooseCamera(const std::string& input, const FrameSourceOptions& source,
                          const CameraArguments& arguments, const PhotoMapperOptions* photos,
                          const PositionsOfMap& positions) {
  const CameraPrior prior = FindPrior(input, arguments);
  if (arguments.is_held && !arguments.file.empty()) return {prior.camera, std::nullopt};
  CameraChoice choice;
  const FootageOpener open = OpenerOf(input, source);
  choice.calibration = photos != nullptr ? CalibrateCameraOfPhotos(prior, open, *photos,
                                                                   arguments.calibration, positions)
                                         : CalibrateCamera(prior, open, arguments.calibration);
  choice.camera = choice.calibration->posterior.camera;
  return choice;
}

namespace {

// Of the one camera for all images.
std::string CameraOfAllLine(const CameraCalibration& calibration) {
  const CameraPrior& prior = calibration.prior;
  const bool is_told = prior.source == CameraPriorSource::kCalibration;
  if (!calibration.is_learned) {
    if (is_told) return {};
    return FocalLength(prior) + " from " + ToString(prior.source) + " (" + prior.description +
           "): " + calibration.reason;
  }
  const CameraModel& camera = calibration.posterior.camera;
  if (is_told && !calibration.contradicts_prior) {
    return "the footage agrees with the calibration; " +
           (camera.shutter.IsGlobal() ? std::string("its shutter is a global one")
                                      : ShutterText(calibration.posterior));
  }
  std::string line = FocalLength(calibration.posterior) + " (was " + Fixed(prior.camera.fx, 1) +
                     " from " + ToString(prior.source) + ")";
  if (is_told) {
    line = "the footage contradicts the calibration by " + Fixed(calibration.change_px, 1) +
           " +- " + Fixed(calibration.uncertainty_px, 1) + " px: " + line +
           " is used; --camera-fixed holds the calibration";
  }
  if (!calibration.determines_focal_length) {
    line += "; the footage does not determine the focal length";
  }
  if (!camera.shutter.IsGlobal()) line += "; " + ShutterText(calibration.posterior);
  return line;
}

}  // namespace

std::string VariationText(const IntrinsicsVariation& variation) {
  const auto& [principal_point_px, focal_share, focal_drift] = variation;
  std::string what;
  if (principal_point_px > 0) {
    what = "the principal point moves by " + Fixed(principal_point_px, 1) +
           " px from image to image, as with image stabilisation";
  }
  if (focal_share > 0) {
    what += (what.empty() ? "" : "; ") + std::string("the focal length changes by ") +
            Fixed(100 * focal_share, 1) + " % from image to image, as with zoom";
  } else if (focal_drift > 0) {
    what += (what.empty() ? "" : "; ") + std::string("the focal length changes by ") +
            Fixed(100 * focal_drift, 0) + " % in the course of the footage, as with zoom";
  }
  if (what.empty()) return {};
  return what + ": one camera for all images is not exact, nor is what comes of it";
}

std::string CameraLine(const CameraCalibration& calibration) {
  const std::string line = CameraOfAllLine(calibration);
  const std::string variation = VariationText(calibration.variation);
  return line + (line.empty() || variation.empty() ? "" : "; ") + variation;
}

std::string CameraLine(const SelfCalibration& self_calibration) {
  const std::optional<CameraCalibration>& calibration = self_calibration.calibration;
  if (!calibration) return "the camera is that of the prior: " + self_calibration.reason;
  const std::string line = CameraLine(*calibration);
  if (self_calibration.adopted_at_frame) {
    return line + ", adopted at frame " + std::to_string(*self_calibration.adopted_at_frame);
  }
  if (!calibration->is_learned) return line;
  return line + "; it was not adopted: " + self_calibration.reason;
}

}  // namespace mono3d::tools
