// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/calibration/camera_calibration.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calibration/camera_adjustment.h"
#include "calibration/camera_posterior.h"
#include "calibration/intrinsics_variation.h"
#include "calibration/photo_footage.h"
#include "calibration/velocity_shortfall.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d {
namespace {

using calibration::AdjustToLens;
using calibration::CalibrationMaps;
using calibration::CameraAdjustment;
using calibration::Contradicts;
using calibration::IsFarFrom;
using calibration::kMaxPoints;
using calibration::TakeLens;
using calibration::TakePosterior;
using calibration::VelocityShortfall;
using calibration::WithDifference;
using calibration::WithLensHeld;
using calibration::WithoutWeight;

// Less than the noise of a tracked point.
constexpr double kConverged_px = 0.05;
// A hundredth of the interval between frames of a video.
constexpr double kConverged_s = 0.0005;
// Of a round with one part of the footage, which only has to come near.
constexpr std::size_t kCoarsePoints = 1000;
// Of an image, of the rounds with all parts. A patch is found at about the same wrong place in all
// images around, so that neither more images nor knowing which patches are bad makes the camera
// better known, but more points do (decision 17).
constexpr int kFeatures = 3000;
// Standard deviation of a tracked point (FeatureOptions::patch_sigma_px) while the camera is still
// off. With the 0.07 px of a good calibration, what contradicts the camera is left out as an
// outlier, and what is left draws the adjustment back to it. One of five values tried on two
// simulated flights (decision 17).
constexpr double kPatchSigma_px = 0.25;

// Of the focal length, as a share of it: what a careful calibration with a board knows it to. Where
// it is known less well, more of the footage is looked at.
constexpr double kWantedFocalSigma = 0.001;
// With longer parts: one, and another where the first ones were off.
constexpr int kRoundsWithLonger = 2;
// Begun anew: from the prior, near it, and as well as the footage tells it.
constexpr int kRoundsAnew = 3;
// Of the focal length: what a calibration that is told is trusted to. Where rounds know it less
// well, their map may have started wrongly, as over flat ground, where a wrong motion bends the map
// but explains the images nearly as well.
constexpr double kDoubtfulFocalSigma = 0.01;
// Of its standard deviation: a right start knows it many times better than a wrong one.
constexpr double kBetterStart = 0.5;

struct TrackedMaps {
  std::vector<SparseModel> maps;
  std::vector<CameraPositions> positions;  // of which map: map_id
  VelocityShortfall shortfall = {};        // unknown of images placed together
};

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

// Frames that are tracked without those before and after.
struct FootagePart {
  int start = 0;
  int num_frames = 0;  // 0: to the end
  bool operator==(const FootagePart&) const = default;
};

// Where all parts together would make up most of the footage, it is one: what hangs together tells
// more (decision 17).
std::vector<FootagePart> ChooseParts(std::optional<std::int64_t> num_frames, int num_parts,
                                     int part_frames) {
  constexpr double kMost = 2. / 3;
  if (!num_frames || num_parts == 1 || *num_frames <= part_frames) return {{0, part_frames}};
  if (kMost * static_cast<double>(*num_frames) <= num_parts * static_cast<double>(part_frames)) {
    return {{0, static_cast<int>(*num_frames)}};
  }
  std::vector<FootagePart> parts;
  for (int i = 0; i < num_parts; ++i) {
    const std::int64_t last = *num_frames - part_frames;
    parts.push_back({static_cast<int>(last * i / (num_parts - 1)), part_frames});
  }
  return parts;
}

// What to look at: the parts, then longer ones where those tell too little. Empty: none.
struct FootageParts {
  std::vector<FootagePart> all;
  std::vector<FootagePart> longer = {};
  bool is_matched_once = false;  // photographs: each round has the same features
};

FootageParts ChooseParts(std::optional<std::int64_t> num_frames,
                         const CalibrationOptions& options) {
  constexpr double kMinGrowth = 1.25;  // else they tell no more
  FootageParts parts{ChooseParts(num_frames, options.num_parts, options.part_frames)};
  if (!num_frames) return parts;
  const double num_in_share =
      options.max_share * static_cast<double>(*num_frames) / options.num_parts;
  const double longest = std::min<double>(options.max_part_frames, num_in_share);
  if (longest >= kMinGrowth * parts.all[0].num_frames) {
    parts.longer = ChooseParts(num_frames, options.num_parts, static_cast<int>(longest));
  }
  return parts;
}

void LogRound(const CameraCalibration& result, double change_px) {
  const CameraPrior& camera = result.posterior;
  Log(LogLevel::kDebug,
      "calibration, round " + std::to_string(result.num_rounds) + ": focal length " +
          std::to_string(camera.camera.fx) + " +- " +
          std::to_string(camera.camera.fx * camera.focal_sigma) + " px, readout " +
          std::to_string(camera.camera.shutter.readout_s) +
          (camera.camera.shutter.reads_columns ? " s by columns +- " : " s +- ") +
          std::to_string(camera.readout_sigma_s) + " s, changed by " + std::to_string(change_px) +
          " px, known to " + std::to_string(result.uncertainty_px) + " px, residuals " +
          std::to_string(result.sigma_px) + " px, " + std::to_string(result.num_images) +
          " images, " + std::to_string(result.num_points) + " points, " +
          std::to_string(result.residuals.size()) + " observations");
}

double ReadoutChange_s(const RollingShutter& a, const RollingShutter& b) {
  return a.reads_columns == b.reads_columns
             ? std::abs(a.readout_s - b.readout_s)
             : std::max(std::abs(a.readout_s), std::abs(b.readout_s));
}

// Of the focal length than what was told claims: such images agree with a wrong one as well.
bool KnowsLess(const CameraAdjustment& adjustment, const CameraPrior& told) {
  return std::sqrt(adjustment.covariance(calibration::kLogFocal, calibration::kLogFocal)) >
         told.focal_sigma;
}

// A round of Calibrate whose camera is nearest to the one it was tracked with: what to believe when
// the rounds do not settle. A round may start its map wrongly and end far off.
struct SteadiestRound {
  double change_px = 0;
  CameraModel camera;
  CameraCalibration result;
};

// With so many features of an image.
using TrackParts =
    std::function<TrackedMaps(const CameraModel&, const std::vector<FootagePart>&, int)>;

struct Rounds {
  CameraCalibration result;
  bool is_settled = false;  // the last one changed the camera by no more than it is known
  double velocity_shortfall = 0;
};

Rounds CalibrateInRounds(const CameraPrior& prior, const TrackParts& track, FootageParts footage,
                         const CalibrationOptions& options) {
  Rounds rounds;
  CameraCalibration& result = rounds.result;
  result.prior = result.posterior = prior;
  // A calibration that may be wrong must not be drawn on to judge it.
  const bool is_told = prior.source == CameraPriorSource::kCalibration;
  CameraPrior weight = is_told ? WithoutWeight(prior) : prior;
  CameraModel camera = prior.camera;
  std::vector<FootagePart>& all_parts = footage.all;
  std::vector<FootagePart> parts = {{0, options.part_frames}};
  bool lens_agrees = false;      // with what was told
  bool is_contradicted = false;  // what was told, by a round
  bool is_tried_again = false;   // with all parts, that knew less than was told
  std::optional<CameraAdjustment> before;
  std::optional<SteadiestRound> steadiest;
  bool& is_settled = rounds.is_settled;
  // That a round was begun with, under the weight and with the parts of now: begun with the same
  // camera, one ends as that one did, and so do all that follow.
  std::vector<CameraModel> begun_with;
  int last_round = options.max_rounds;
  bool was_settled = false;  // with the shorter parts
  // What the rounds before came to that knew little. Those after it begin with the prior and with
  // other features, so that their map starts otherwise.
  std::optional<Rounds> doubtful;
  for (int round = 1; round <= last_round; ++round) {
    if (std::ranges::find(begun_with, camera) != begun_with.end()) break;
    begun_with.push_back(camera);
    const bool is_coarse = parts != all_parts && !is_told;
    const bool has_more_features = parts == all_parts && !doubtful;
    const TrackedMaps tracked =
        track(camera, parts, has_more_features ? kFeatures : FeatureOptions().num_features);
    rounds.velocity_shortfall = tracked.shortfall.Share();
    const CalibrationMaps maps{tracked.maps, tracked.positions,
                               is_coarse ? kCoarsePoints : kMaxPoints};
    CameraAdjustment adjustment = AdjustToLens(weight, camera, maps);
    const bool has_weight = prior.source != CameraPriorSource::kDefault && !is_told;
    if (has_weight && !result.contradicts_prior && IsFarFrom(prior, adjustment.camera)) {
      result.contradicts_prior = true;
      weight = DefaultCameraPrior(camera.width, camera.height, camera.lens);
      begun_with.clear();
      adjustment = AdjustToLens(weight, adjustment.camera, maps);
    }
    if (adjustment.num_observations == 0) {
      if (parts == all_parts && is_tried_again && !is_contradicted) {
        // The round before knew too little to contradict what was told.
        lens_agrees = true;
        TakeLens(prior, camera);
        TakeLens(prior, result.posterior);
      }
      if (parts == all_parts) break;
      parts = all_parts;  // more may be seen elsewhere
      begun_with.clear();
      continue;
    }
    const double change_px = LargestDifference_px(camera, adjustment.camera);
    const double change_s = ReadoutChange_s(camera.shutter, adjustment.camera.shutter);
    const double focal_change = std::abs(std::log(adjustment.camera.fx / camera.fx));
    camera = adjustment.camera;
    result.num_rounds = round;
    TakePosterior(adjustment, result);
    // Two rounds choose other keyframes: their difference has more variance than either.
    const bool is_lens_settled = change_px <= std::max(kConverged_px, 2 * result.uncertainty_px) &&
                                 focal_change <= 2 * result.posterior.focal_sigma;
    const bool is_readout_settled =
        change_s <= std::max(kConverged_s, 2 * result.posterior.readout_sigma_s);
    if (before) TakePosterior(WithDifference(adjustment, *before), result);
    before = adjustment;
    Log(LogLevel::kDebug, "calibration: velocities fall short by " +
                              std::to_string(100 * rounds.velocity_shortfall) + " % at most");
    LogRound(result, change_px);
    if (is_told && !lens_agrees) {
      begun_with.clear();
      lens_agrees = !Contradicts(adjustment, prior);
      if (lens_agrees && KnowsLess(adjustment, prior)) {
        if (parts != all_parts) {
          lens_agrees = false;
          camera = prior.camera;
          parts = all_parts;
          before.reset();
          continue;
        }
        // Maps of a wrong camera may be why little is known: one of the better camera tells.
        if (!is_tried_again && round < last_round) {
          is_tried_again = true;
          lens_agrees = false;
          continue;
        }
        // Such a round does not take back what another one has found.
        lens_agrees = !is_contradicted;
      }
      is_contradicted = is_contradicted || !lens_agrees;
      if (lens_agrees) {
        weight = WithLensHeld(weight);
        TakeLens(prior, camera);
        TakeLens(prior, result.posterior);
        if (camera == prior.camera) break;
      } else {
        // It is wrong: what the images do not tell is better taken from an ordinary lens.
        weight = DefaultCameraPrior(camera.width, camera.height, camera.lens);
      }
    } else if (lens_agrees) {
      TakeLens(prior, result.posterior);
    }
    is_settled = parts == all_parts && (lens_agrees || is_lens_settled) && is_readout_settled;
    const bool is_known = lens_agrees || result.posterior.focal_sigma <= kWantedFocalSigma;
    const bool is_at_end = is_settled || (round == last_round && parts == all_parts);
    if (is_at_end && !is_known && !footage.longer.empty()) {
      was_settled = std::exchange(is_settled, false);
      parts = all_parts = std::exchange(footage.longer, {});
      last_round = round + kRoundsWithLonger;
      begun_with.clear();
      before.reset();
      steadiest.reset();
      continue;
    }
    const bool can_begin_anew = !doubtful && !is_told && !footage.is_matched_once;
    if (is_at_end && can_begin_anew && result.posterior.focal_sigma > kDoubtfulFocalSigma) {
      if (!is_settled && steadiest && steadiest->change_px <= change_px) result = steadiest->result;
      doubtful = rounds;
      is_settled = false;
      result.contradicts_prior = false;
      camera = prior.camera;
      weight = prior;
      last_round = round + kRoundsAnew;
      begun_with.clear();
      before.reset();
      steadiest.reset();
      continue;
    }
    if (is_settled) break;
    if (parts == all_parts && (!steadiest || change_px < steadiest->change_px)) {
      steadiest = {change_px, camera, result};
    }
    if (parts != all_parts) begun_with.clear();
    parts = all_parts;
  }
  if (!is_settled && steadiest && !lens_agrees) {
    camera = steadiest->camera;
    result = steadiest->result;
  }
  if (doubtful &&
      !(result.posterior.focal_sigma < kBetterStart * doubtful->result.posterior.focal_sigma)) {
    const int num_rounds = result.num_rounds;
    const IntrinsicsVariation also_seen = result.variation;
    rounds = std::move(*doubtful);
    result.num_rounds = num_rounds;
    // One map may take the motion of a section of the image for the camera's where the other does
    // not.
    IntrinsicsVariation& seen = result.variation;
    seen.principal_point_px = std::max(seen.principal_point_px, also_seen.principal_point_px);
    seen.focal_share = std::max(seen.focal_share, also_seen.focal_share);
    camera = result.posterior.camera;
  }
  is_settled = is_settled || was_settled;
  result.change_px = LargestDifference_px(prior.camera, camera);
  if (result.num_rounds == 0) {
    result.reason = "too little of the footage can be tracked";
  } else if (lens_agrees && camera == prior.camera) {
    result.reason = "the images agree with the calibration";
  } else if (camera == prior.camera) {
    result.reason = "the images do not determine the camera";
  } else {
    result.is_learned = true;
    result.contradicts_prior = result.contradicts_prior || (is_told && !lens_agrees);
  }
  return rounds;
}

// With a camera that is told far off, maps may start wrongly, and rounds that begin with such maps
// lead nowhere; or nothing can be tracked at all.
bool LeadsNowhere(const Rounds& rounds) {
  const CameraCalibration& result = rounds.result;
  if (result.num_rounds == 0) return true;
  return result.contradicts_prior && !(rounds.is_settled && result.determines_focal_length);
}

// What came of them; a readout time is known no better than the velocities.
CameraCalibration EndOf(Rounds rounds) {
  CameraPrior& posterior = rounds.result.posterior;
  posterior.readout_sigma_s = std::hypot(
      posterior.readout_sigma_s, rounds.velocity_shortfall * posterior.camera.shutter.readout_s);
  return std::move(rounds.result);
}

CameraCalibration Calibrate(const CameraPrior& prior, const TrackParts& track,
                            const FootageParts& footage, const CalibrationOptions& options) {
  Rounds rounds = CalibrateInRounds(prior, track, footage, options);
  if (prior.source != CameraPriorSource::kCalibration || !LeadsNowhere(rounds)) {
    return EndOf(std::move(rounds));
  }
  Log(LogLevel::kDebug, "calibration: begins again, with nothing of what was told");
  const CameraModel& told = prior.camera;
  Rounds of_unknown = CalibrateInRounds(DefaultCameraPrior(told.width, told.height, told.lens),
                                        track, footage, options);
  if (!of_unknown.is_settled || !of_unknown.result.determines_focal_length) {
    return EndOf(std::move(rounds));
  }
  CameraCalibration anew = EndOf(std::move(of_unknown));
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
  CameraCalibration result = Calibrate(prior.Resized(width, height), track,
                                       ChooseParts(source->num_frames(), options), options);
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
