// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/photo_cameras.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <system_error>

#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"

namespace mono3d::tools {
namespace {

// A video, a single image, or nothing that is there.
bool IsNoList(const std::string& input) {
  std::error_code ignored;
  if (std::filesystem::exists(input, ignored)) {
    return !std::filesystem::is_directory(input, ignored);
  }
  return input.find_first_of("*?[") == std::string::npos;  // no glob
}

std::string NameOf(const CameraGroup& group) {
  const bool names_make = group.make.empty() || group.model.starts_with(group.make);
  std::string name = names_make ? group.model : group.make + " " + group.model;
  if (!group.lens.empty()) name += (name.empty() ? "" : ", ") + group.lens;
  return name;
}

std::string SizeOf(const CameraModel& camera) {
  return std::to_string(camera.width) + "x" + std::to_string(camera.height);
}

// The group that a calibration is of.
std::size_t GroupOfCalibration(const CameraModel& told, const std::string& file,
                               const std::vector<CameraGroup>& groups) {
  std::optional<std::size_t> best;
  const auto difference = [&](std::size_t i) {
    return std::abs(std::log(groups[i].prior.camera.fx / told.fx));
  };
  std::string sizes;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const CameraModel& camera = groups[i].prior.camera;
    sizes += (sizes.empty() ? "" : ", ") + SizeOf(camera);
    if (camera.width != told.width || camera.height != told.height) continue;
    const bool is_better = !best || difference(i) < difference(*best) ||
                           (difference(i) == difference(*best) &&
                            groups[i].images.size() > groups[*best].images.size());
    if (is_better) best = i;
  }
  if (best) return *best;
  throw UsageError(ErrorParts{.what = "the calibration is of another size than all photographs",
                              .where = file,
                              .expected = sizes,
                              .found = SizeOf(told)});
}

std::vector<CameraPrior> PriorsOf(const std::vector<CameraGroup>& groups,
                                  const CameraArguments& arguments) {
  std::vector<CameraPrior> priors;
  for (const CameraGroup& group : groups) {
    const CameraModel& camera = group.prior.camera;
    priors.push_back(arguments.lens == ToString(LensModel::kFisheye)
                         ? DefaultCameraPrior(camera.width, camera.height, LensModel::kFisheye)
                         : group.prior);
  }
  if (arguments.file.empty()) return priors;
  const CameraPrior told = FindPrior({}, arguments);
  CameraPrior& prior = priors[GroupOfCalibration(told.camera, arguments.file, groups)];
  prior = told;
  if (arguments.is_held) {
    prior.focal_sigma = prior.aspect_sigma = prior.principal_point_sigma_px = 0;
    prior.distortion_sigma = {};
    prior.readout_sigma_s = 0;
  }
  return priors;
}

}  // namespace

bool AreOfSeveralCameras(const std::string& input) {
  constexpr std::size_t kNumSamples = 40;
  if (IsNoList(input)) return false;
  const std::vector<std::string> images = ListImages(input);
  std::vector<std::string> sample;
  const std::size_t num = std::min(images.size(), kNumSamples);
  for (std::size_t i = 0; i < num; ++i) sample.push_back(images[i * images.size() / num]);
  // One odd image is a stray one among the frames of a video.
  constexpr std::size_t kFewestOfOthers = 2;
  std::size_t num_grouped = 0;
  std::size_t num_of_largest = 0;
  for (const CameraGroup& group : GroupByCamera(sample)) {
    num_grouped += group.images.size();
    num_of_largest = std::max(num_of_largest, group.images.size());
  }
  return num_grouped - num_of_largest >= kFewestOfOthers;
}

std::vector<CameraGroup> GroupsOfInput(const std::string& input) {
  return IsNoList(input) ? std::vector<CameraGroup>() : GroupByCamera(ListImages(input));
}

PhotoCameras ChooseCamerasOfPhotos(const std::string& input, const std::vector<CameraGroup>& groups,
                                   const FrameSourceOptions& source,
                                   const CameraArguments& arguments,
                                   const PhotoMapperOptions& photos,
                                   const PositionsOfMap& positions) {
  std::map<std::string, std::size_t> group_of_image;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (const std::string& image : groups[i].images) group_of_image[image] = i;
  }
  PhotoCameras result;
  for (const std::string& image : ListImages(input)) {
    // One that cannot be read is in no group, and will be skipped.
    const auto found = group_of_image.find(image);
    result.cameras.camera_of_image.push_back(found == group_of_image.end() ? 0 : found->second);
  }
  const std::vector<CameraPrior> priors = PriorsOf(groups, arguments);
  const auto open = [&](std::span<const CameraModel> cameras) {
    return OpenFrameSource(
        input, {{cameras.begin(), cameras.end()}, result.cameras.camera_of_image}, source);
  };
  const auto camera_of_frame = [&](std::int64_t frame) { return result.cameras.Of(frame); };
  std::vector<CameraCalibration> found = CalibrateCamerasOfPhotos(
      priors, camera_of_frame, open, photos, arguments.calibration, positions);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    result.cameras.cameras.push_back(found[i].posterior.camera);
    result.of_run.push_back({NameOf(groups[i]), static_cast<std::int64_t>(groups[i].images.size()),
                             std::move(found[i])});
  }
  return result;
}

std::string PhotoCameraLine(std::size_t number, const CameraOfRun& camera) {
  const CameraCalibration& calibration = camera.calibration;
  std::string line = CameraLine(calibration);
  if (calibration.prior.source == CameraPriorSource::kCalibration && !calibration.is_learned) {
    line = "--camera is of these; " + calibration.reason;
  }
  return "camera " + std::to_string(number) +
         (camera.name.empty() ? std::string() : " (" + camera.name + ")") + ", " +
         std::to_string(camera.num_photos) + " photograph" + (camera.num_photos == 1 ? "" : "s") +
         " of " + SizeOf(calibration.prior.camera) + ": " + line;
}

}  // namespace mono3d::tools
