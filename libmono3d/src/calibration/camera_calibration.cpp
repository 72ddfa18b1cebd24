// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/calibration/camera_calibration.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calibration/calibration_rounds.h"
#include "calibration/camera_posterior.h"
#include "calibration/footage_parts.h"
#include "calibration/intrinsics_variation.h"
#include "calibration/photo_footage.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d {
namespace {

using calibration::CalibrationRounds;
using calibration::FootagePart;
using calibration::FootageParts;
using calibration::LearnedCamera;
using calibration::TrackedMaps;
using calibration::TrackParts;

// Standard deviation of a tracked point (FeatureOptions::patch_sigma_px) while the camera is still
// off. With the 0.07 px of a good calibration, what contradicts the camera is left out as an
// outlier, and what is left draws the adjustment back to it. One of five values tried on two
// simulated flights (decision 17).
constexpr double kPatchSigma_px = 0.25;

// The maps of what can be tracked, with pixels as `camera` shows them. Footage that breaks off with
// an error is good up to there; who reads all of it will meet the error again.
void TrackFootage(FrameSource& source, const CameraModel& camera, int num_features,
                  TrackedMaps& tracked) {
  TrackerOptions options;
  options.features.num_features = num_features;
  options.features.patch_sigma_px = kPatchSigma_px;
  // A map needs no keyframe whose points others show; of the camera it tells as much as any other.
  options.mapping.max_redundant_share = 1;
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  try {
    while (const std::optional<Frame> frame = source.Next()) (void)tracker->Track(*frame);
  } catch (const Error& error) {
    Log(LogLevel::kDebug, std::string("calibration: ") + error.what());
  }
  tracker->WaitForMapping();
  (void)tracker->Finish();
  std::set<int> map_ids;
  for (const TrajectoryEntry& entry : tracker->KeyframeTrajectory()) map_ids.insert(entry.map_id);
  for (const int id : map_ids) {
    tracked.maps.push_back(WithCamera(tracker->Sparse(id), camera));
  }
  tracked.shortfall.Add(tracker->Trajectory());
}

// With a camera that is told far off, maps may start wrongly, and rounds that begin with such maps
// lead nowhere; or nothing can be tracked at all.
bool LeadsNowhere(const LearnedCamera& learned) {
  const CameraCalibration& result = learned.calibration;
  if (result.num_rounds == 0) return true;
  return result.contradicts_prior && !(learned.is_settled && result.determines_focal_length);
}

// A readout time is known no better than the velocities.
CameraCalibration WithShortfall(LearnedCamera learned) {
  CameraPrior& posterior = learned.calibration.posterior;
  posterior.readout_sigma_s = std::hypot(
      posterior.readout_sigma_s, learned.velocity_shortfall * posterior.camera.shutter.readout_s);
  return std::move(learned.calibration);
}

CameraCalibration Calibrate(const CameraPrior& prior, const TrackParts& track,
                            const FootageParts& footage, const CalibrationOptions& options) {
  LearnedCamera learned = CalibrationRounds(prior, track, footage, options).Run();
  if (prior.source != CameraPriorSource::kCalibration || !LeadsNowhere(learned)) {
    return WithShortfall(std::move(learned));
  }
  Log(LogLevel::kDebug, "calibration: begins again, with nothing of what was told");
  const CameraModel& told = prior.camera;
  LearnedCamera of_unknown =
      CalibrationRounds(DefaultCameraPrior(told.width, told.height, told.lens), track, footage,
                        options)
          .Run();
  if (!of_unknown.is_settled || !of_unknown.calibration.determines_focal_length) {
    return WithShortfall(std::move(learned));
  }
  CameraCalibration anew = WithShortfall(std::move(of_unknown));
  anew.prior = prior;
  anew.posterior.source = prior.source;
  anew.posterior.description = prior.description;
  anew.change_px = LargestDifference_px(told, anew.posterior.camera);
  anew.is_learned = true;
  anew.contradicts_prior = true;
  anew.reason.clear();
  return anew;
}

}  // namespace

double LargestDifference_px(const CameraModel& a, const CameraModel& b) {
  constexpr int kSteps = 8;  // the maximum lies on the border, mostly in a corner
  double largest = 0;
  const CameraModel linear = calibration::PinholeOfField(a);
  for (int i = 0; i <= kSteps; ++i) {
    for (int k = 0; k <= kSteps; ++k) {
      const Eigen::Vector2d share(static_cast<double>(i) / kSteps, static_cast<double>(k) / kSteps);
      const Eigen::Vector3d ray =
          linear.Unproject({share.x() * (a.width - 1), share.y() * (a.height - 1)});
      largest = std::max(largest, (ProjectDistorted(a, ray) - ProjectDistorted(b, ray)).norm());
    }
  }
  return largest;
}

CameraCalibration CalibrateCamera(const CameraPrior& prior, const FootageOpener& open,
                                  const CalibrationOptions& options) {
  options.Validate();
  Validate(prior, "calibration");
  const CameraModel& told = prior.camera;
  const std::unique_ptr<FrameSource> source = open(told, 0, 0);
  // The source may resize images and camera.
  const int width = source->camera().width;
  const int height = source->camera().height;
  std::vector<SparseModel> latest;
  const auto track = [&](const CameraModel& camera, const std::vector<FootagePart>& parts,
                         int num_features) {
    TrackedMaps tracked;
    for (const FootagePart& part : parts) {
      const std::unique_ptr<FrameSource> footage =
          open(camera.Resized(told.width, told.height), part.start, part.num_frames);
      TrackFootage(*footage, camera, num_features, tracked);
    }
    latest = tracked.maps;
    return tracked;
  };
  CameraCalibration result =
      Calibrate(prior.Resized(width, height), track,
                calibration::ChooseParts(source->num_frames(), options), options);
  result.variation.focal_drift =
      calibration::MeasureFocalDrift(std::move(latest), result.posterior.camera);
  calibration::BringToSize(prior, result);
  return result;
}

CameraCalibration CalibrateCameraOfPhotos(const CameraPrior& prior, const FootageOpener& open,
                                          const PhotoMapperOptions& photos,
                                          const CalibrationOptions& options,
                                          const PositionsOfMap& positions) {
  options.Validate();
  photos.Validate();
  Validate(prior, "calibration");
  const std::unique_ptr<FrameSource> source = open(prior.camera, 0, 0);
  const CameraPrior at_size = prior.Resized(source->camera().width, source->camera().height);
  const calibration::PhotoFootage footage(*source, at_size.camera, photos);
  CameraCalibration result = Calibrate(
      at_size,
      [&](const CameraModel& camera, const std::vector<FootagePart>&, int) {
        TrackedMaps placed{footage.Map(camera), {}};
        placed.positions = calibration::PositionsOf(placed.maps, positions);
        return placed;
      },
      {.all = {{0, options.part_frames}}, .is_matched_once = true}, options);
  calibration::BringToSize(prior, result);
  return result;
}

void CalibrationOptions::Visit(OptionVisitor& visit) {
  visit("num_parts", num_parts, "parts of the footage that are looked at");
  visit("part_frames", part_frames, "frames of each part");
  visit("max_part_frames", max_part_frames,
        "frames of each part where fewer do not tell the focal length to 0.1 %");
  visit("max_share", max_share, "of the footage that such parts may be together");
  visit("max_rounds", max_rounds, "how often they are tracked, each time with a better camera");
}

void CalibrationOptions::Validate() const {
  if (num_parts < 1) throw UsageError("calibration.num_parts must be 1 or more");
  if (part_frames < 3) throw UsageError("calibration.part_frames must be 3 or more");
  if (max_part_frames < 0) throw UsageError("calibration.max_part_frames must be 0 or more");
  if (!(max_share >= 0 && max_share <= 1)) {
    throw UsageError("calibration.max_share must be between 0 and 1");
  }
  if (max_rounds < 1) throw UsageError("calibration.max_rounds must be 1 or more");
}

}  // namespace mono3d
