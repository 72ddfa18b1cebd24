// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "calibration/camera_adjustment.h"
#include "calibration/camera_posterior.h"
#include "calibration/photo_footage.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/core/log.h"
#include "mono3d/image/undistorter.h"

namespace mono3d {
namespace {

using calibration::CameraAdjustment;

// Less than the noise of a feature.
constexpr double kSettled_px = 0.05;

// A prior at the size at which its photos have the focal length of the common image: then all
// features are about equally exact in pixels.
CameraPrior AtScaleOf(const CameraModel& common, const CameraPrior& prior) {
  const CameraModel& camera = prior.camera;
  const CameraModel undistorted = Undistorter(camera).camera();
  const double scale = common.fx / std::sqrt(undistorted.fx * undistorted.fy);
  const auto scaled = [&](int size) {
    return std::max(1, static_cast<int>(std::lround(scale * size)));
  };
  return prior.Resized(scaled(camera.width), scaled(camera.height));
}

// One of the cameras, what is known of it so far, and the weight of what was known before.
class CameraOfPhotos {
 public:
  explicit CameraOfPhotos(const CameraPrior& prior)
      : is_told_(prior.source == CameraPriorSource::kCalibration && prior.focal_sigma > 0),
        is_held_(prior.focal_sigma == 0),
        // A calibration that may be wrong must not be drawn on to judge it.
        weight_(is_told_ ? calibration::WithoutWeight(prior) : prior),
        camera_(prior.camera) {
    result_.prior = result_.posterior = prior;
  }

  const CameraPrior& weight() const { return weight_; }
  const CameraModel& camera() const { return camera_; }

  // Are the metadata wrong? Then they have no more weight.
  bool DropsMetadata(const CameraAdjustment& adjustment) {
    const bool is_metadata =
        !is_told_ && !is_held_ && result_.prior.source != CameraPriorSource::kDefault;
    if (!is_metadata || result_.contradicts_prior || adjustment.num_observations == 0 ||
        !calibration::IsFarFrom(result_.prior, adjustment.camera)) {
      return false;
    }
    result_.contradicts_prior = true;
    weight_ = DefaultCameraPrior(camera_.width, camera_.height, camera_.lens);
    return true;
  }

  // Has it changed by no more than it is known to?
  bool Take(const CameraAdjustment& adjustment) {
    if (adjustment.num_observations == 0) return true;
    ++result_.num_rounds;
    const double change_px = LargestDifference_px(camera_, adjustment.camera);
    camera_ = adjustment.camera;
    calibration::TakePosterior(adjustment, result_);
    if (is_told_ && !agrees_) {
      agrees_ = !calibration::Contradicts(adjustment, result_.prior);
      if (agrees_) {
        weight_ = calibration::WithLensHeld(weight_);
        weight_.readout_sigma_s = 0;
        weight_.camera = camera_ = result_.prior.camera;
        return false;
      }
      // It is wrong: what the images do not tell is better taken from an ordinary lens.
      weight_ = DefaultCameraPrior(camera_.width, camera_.height, camera_.lens);
      is_told_wrong_ = true;
      is_told_ = false;
      return false;
    }
    return agrees_ || is_held_ || change_px <= std::max(kSettled_px, 2 * result_.uncertainty_px);
  }

  // At the size of `prior`.
  CameraCalibration Result(const CameraPrior& prior) const {
    CameraCalibration result = result_;
    if (agrees_ || is_held_) result.posterior = result.prior;
    result.change_px = LargestDifference_px(result.prior.camera, camera_);
    if (is_held_) {
      result.reason = "the calibration is held";
    } else if (result.num_rounds == 0) {
      result.reason = "none of its photographs is in a map";
    } else if (agrees_) {
      result.reason = "the images agree with the calibration";
    } else if (camera_ == result.prior.camera) {
      result.reason = "the images do not determine the camera";
    } else {
      result.is_learned = true;
      result.contradicts_prior = result.contradicts_prior || is_told_wrong_;
    }
    calibration::BringToSize(prior, result);
    return result;
  }

 private:
  bool is_told_;
  bool is_held_;
  bool agrees_ = false;  // with what was told
  bool is_told_wrong_ = false;
  CameraPrior weight_;
  CameraModel camera_;
  CameraCalibration result_;
};

std::vector<CameraAdjustment> AdjustPhotoCameras(const std::vector<CameraOfPhotos>& cameras,
                                                 const std::vector<CameraModel>& starts,
                                                 const calibration::CalibrationMaps& maps) {
  std::vector<CameraPrior> weights;
  for (const CameraOfPhotos& camera : cameras) weights.push_back(camera.weight());
  return calibration::AdjustCameras(std::move(weights), starts, maps);
}

std::vector<CameraModel> ModelsOf(const std::vector<CameraOfPhotos>& cameras) {
  std::vector<CameraModel> models;
  for (const CameraOfPhotos& camera : cameras) models.push_back(camera.camera());
  return models;
}

// Have all changed by no more than they are known to?
bool LearnOnce(const calibration::PhotoFootage& footage, const CameraModel& common,
               const PositionsOfMap& positions, std::vector<CameraOfPhotos>& cameras) {
  const std::vector<CameraModel> starts = ModelsOf(cameras);
  const std::vector<SparseModel> placed = footage.Map(starts, common);
  const std::vector<CameraPositions> measured = calibration::PositionsOf(placed, positions);
  const calibration::CalibrationMaps maps{placed, measured};
  std::vector<CameraAdjustment> adjustments = AdjustPhotoCameras(cameras, starts, maps);
  bool drops_metadata = false;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    drops_metadata = cameras[i].DropsMetadata(adjustments[i]) || drops_metadata;
  }
  if (drops_metadata) adjustments = AdjustPhotoCameras(cameras, starts, maps);
  bool is_settled = true;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    is_settled = cameras[i].Take(adjustments[i]) && is_settled;
    Log(LogLevel::kDebug, "calibration of photographs, camera " + std::to_string(i + 1) +
                              ": focal length " + std::to_string(cameras[i].camera().fx) +
                              " px at a width of " + std::to_string(cameras[i].camera().width) +
                              ", " + std::to_string(adjustments[i].num_images) + " images");
  }
  return is_settled;
}

}  // namespace

std::vector<CameraCalibration> CalibrateCamerasOfPhotos(
    std::span<const CameraPrior> priors,
    const std::function<std::size_t(std::int64_t)>& camera_of_frame, const PhotosOpener& open,
    const PhotoMapperOptions& photos, const CalibrationOptions& options,
    const PositionsOfMap& positions) {
  options.Validate();
  photos.Validate();
  std::vector<CameraModel> told;
  for (const CameraPrior& prior : priors) {
    Validate(prior, "calibration");
    told.push_back(prior.camera);
  }
  const std::unique_ptr<FrameSource> source = open(told);
  const CameraModel common = source->camera();
  std::vector<CameraOfPhotos> cameras;
  for (const CameraPrior& prior : priors) cameras.emplace_back(AtScaleOf(common, prior));
  const calibration::PhotoFootage footage(*source, ModelsOf(cameras), camera_of_frame, photos);
  for (int round = 0; round < options.max_rounds; ++round) {
    if (LearnOnce(footage, common, positions, cameras)) break;
  }
  std::vector<CameraCalibration> results;
  for (std::size_t i = 0; i < cameras.size(); ++i) results.push_back(cameras[i].Result(priors[i]));
  return results;
}

}  // namespace mono3d
