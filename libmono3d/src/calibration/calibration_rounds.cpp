// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/calibration_rounds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "calibration/camera_parameters.h"
#include "calibration/camera_posterior.h"
#include "calibration/camera_problem.h"
#include "mono3d/core/log.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d::calibration {
namespace {

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
  return std::sqrt(adjustment.covariance(kLogFocal, kLogFocal)) > told.focal_sigma;
}

}  // namespace

CalibrationRounds::CalibrationRounds(const CameraPrior& prior, TrackParts track,
                                     FootageParts footage, const CalibrationOptions& options)
    : prior_(prior),
      track_(std::move(track)),
      footage_(std::move(footage)),
      is_told_(prior.source == CameraPriorSource::kCalibration),
      last_round_(options.max_rounds),
      // A calibration that may be wrong must not be drawn on to judge it.
      weight_(is_told_ ? WithoutWeight(prior) : prior),
      camera_(prior.camera),
      parts_({{0, options.part_frames}}) {
  learned_.calibration.prior = learned_.calibration.posterior = prior;
}

LearnedCamera CalibrationRounds::Run() {
  while (round_ < last_round_ && std::ranges::find(begun_with_, camera_) == begun_with_.end()) {
    ++round_;
    begun_with_.push_back(camera_);
    if (!DoRound()) break;
  }
  return Conclude();
}

void CalibrationRounds::Restart() {
  begun_with_.clear();
  before_.reset();
  steadiest_.reset();
}

bool CalibrationRounds::DoRound() {
  const CameraAdjustment adjustment = AdjustTracked();
  if (adjustment.num_observations == 0) return AfterNothingTracked() == Step::kNextRound;
  const Change change = TakeAdjustment(adjustment);
  CameraCalibration& result = learned_.calibration;
  if (is_told_ && !lens_agrees_) {
    const Step step = CompareWithTold(adjustment);
    if (step != Step::kDecide) return step == Step::kNextRound;
  } else if (lens_agrees_) {
    TakeLens(prior_, result.posterior);
  }
  const bool is_settled = LooksAtAll() && (lens_agrees_ || change.is_lens_within_chance) &&
                          change.is_readout_within_chance;
  learned_.is_settled = is_settled;
  if (is_settled || (round_ == last_round_ && LooksAtAll())) {
    if (LooksLonger() || BeginsAnew(change.largest_px)) return true;
  }
  if (is_settled) return false;
  if (!LooksAtAll()) {
    parts_ = footage_.all;
    begun_with_.clear();
  } else if (!steadiest_ || change.largest_px < steadiest_->change_px) {
    steadiest_ = {change.largest_px, camera_, result};
  }
  return true;
}

CameraAdjustment CalibrationRounds::AdjustTracked() {
  const bool is_coarse = !LooksAtAll() && !is_told_;
  const bool has_more_features = LooksAtAll() && !doubtful_;
  const TrackedMaps tracked =
      track_(camera_, parts_, has_more_features ? kFeatures : FeatureOptions().num_features);
  learned_.velocity_shortfall = tracked.shortfall.Share();
  const CalibrationMaps maps{tracked.maps, tracked.positions,
                             is_coarse ? kCoarsePoints : kMaxPoints};
  CameraAdjustment adjustment = AdjustToLens(weight_, camera_, maps);
  const bool has_weight = prior_.source != CameraPriorSource::kDefault && !is_told_;
  bool& contradicts = learned_.calibration.contradicts_prior;
  if (has_weight && !contradicts && IsFarFrom(prior_, adjustment.camera)) {
    contradicts = true;
    weight_ = DefaultCameraPrior(camera_.width, camera_.height, camera_.lens);
    begun_with_.clear();
    adjustment = AdjustToLens(weight_, adjustment.camera, maps);
  }
  return adjustment;
}

CalibrationRounds::Step CalibrationRounds::AfterNothingTracked() {
  if (!LooksAtAll()) {  // more may be seen elsewhere
    parts_ = footage_.all;
    begun_with_.clear();
    return Step::kNextRound;
  }
  if (is_tried_again_ && !is_contradicted_) {
    // The round before knew too little to contradict what was told.
    lens_agrees_ = true;
    TakeLens(prior_, camera_);
    TakeLens(prior_, learned_.calibration.posterior);
  }
  return Step::kEnd;
}

CalibrationRounds::Change CalibrationRounds::TakeAdjustment(const CameraAdjustment& adjustment) {
  CameraCalibration& result = learned_.calibration;
  Change change;
  change.largest_px = LargestDifference_px(camera_, adjustment.camera);
  const double change_s = ReadoutChange_s(camera_.shutter, adjustment.camera.shutter);
  const double focal_change = std::abs(std::log(adjustment.camera.fx / camera_.fx));
  camera_ = adjustment.camera;
  result.num_rounds = round_;
  TakePosterior(adjustment, result);
  // Two rounds choose other keyframes: their difference has more variance than either.
  change.is_lens_within_chance =
      change.largest_px <= std::max(kConverged_px, 2 * result.uncertainty_px) &&
      focal_change <= 2 * result.posterior.focal_sigma;
  change.is_readout_within_chance =
      change_s <= std::max(kConverged_s, 2 * result.posterior.readout_sigma_s);
  if (before_) TakePosterior(WithDifference(adjustment, *before_), result);
  before_ = adjustment;
  Log(LogLevel::kDebug, "calibration: velocities fall short by " +
                            std::to_string(100 * learned_.velocity_shortfall) + " % at most");
  LogRound(result, change.largest_px);
  return change;
}

CalibrationRounds::Step CalibrationRounds::CompareWithTold(const CameraAdjustment& adjustment) {
  begun_with_.clear();
  lens_agrees_ = !Contradicts(adjustment, prior_);
  if (lens_agrees_ && KnowsLess(adjustment, prior_)) {
    if (!LooksAtAll()) {
      lens_agrees_ = false;
      camera_ = prior_.camera;
      parts_ = footage_.all;
      before_.reset();
      return Step::kNextRound;
    }
    // Maps of a wrong camera may be why little is known: one of the better camera tells.
    if (!is_tried_again_ && round_ < last_round_) {
      is_tried_again_ = true;
      lens_agrees_ = false;
      return Step::kNextRound;
    }
    // Such a round does not take back what another one has found.
    lens_agrees_ = !is_contradicted_;
  }
  is_contradicted_ = is_contradicted_ || !lens_agrees_;
  if (!lens_agrees_) {
    // It is wrong: what the images do not tell is better taken from an ordinary lens.
    weight_ = DefaultCameraPrior(camera_.width, camera_.height, camera_.lens);
    return Step::kDecide;
  }
  weight_ = WithLensHeld(weight_);
  TakeLens(prior_, camera_);
  TakeLens(prior_, learned_.calibration.posterior);
  return camera_ == prior_.camera ? Step::kEnd : Step::kDecide;
}

bool CalibrationRounds::LooksLonger() {
  const bool is_known =
      lens_agrees_ || learned_.calibration.posterior.focal_sigma <= kWantedFocalSigma;
  if (is_known || footage_.longer.empty()) return false;
  was_settled_ = std::exchange(learned_.is_settled, false);
  parts_ = footage_.all = std::exchange(footage_.longer, {});
  last_round_ = round_ + kRoundsWithLonger;
  Restart();
  return true;
}

bool CalibrationRounds::BeginsAnew(double change_px) {
  if (doubtful_ || is_told_ || footage_.is_matched_once) return false;
  if (learned_.calibration.posterior.focal_sigma <= kDoubtfulFocalSigma) return false;
  if (!learned_.is_settled && steadiest_ && steadiest_->change_px <= change_px) {
    learned_.calibration = steadiest_->calibration;
  }
  doubtful_ = learned_;
  learned_.is_settled = false;
  learned_.calibration.contradicts_prior = false;
  camera_ = prior_.camera;
  weight_ = prior_;
  last_round_ = round_ + kRoundsAnew;
  Restart();
  return true;
}

void CalibrationRounds::ChooseBetterBeginning() {
  CameraCalibration& result = learned_.calibration;
  const double first_sigma = doubtful_->calibration.posterior.focal_sigma;
  if (result.posterior.focal_sigma < kBetterStart * first_sigma) return;
  const int num_rounds = result.num_rounds;
  const IntrinsicsVariation also_seen = result.variation;
  learned_ = std::move(*doubtful_);
  result.num_rounds = num_rounds;
  // One map may take the motion of a section of the image for the camera's where the other does
  // not.
  IntrinsicsVariation& seen = result.variation;
  seen.principal_point_px = std::max(seen.principal_point_px, also_seen.principal_point_px);
  seen.focal_share = std::max(seen.focal_share, also_seen.focal_share);
  camera_ = result.posterior.camera;
}

LearnedCamera CalibrationRounds::Conclude() {
  CameraCalibration& result = learned_.calibration;
  if (!learned_.is_settled && steadiest_ && !lens_agrees_) {
    camera_ = steadiest_->camera;
    result = steadiest_->calibration;
  }
  if (doubtful_) ChooseBetterBeginning();
  learned_.is_settled = learned_.is_settled || was_settled_;
  result.change_px = LargestDifference_px(prior_.camera, camera_);
  if (result.num_rounds == 0) {
    result.reason = "too little of the footage can be tracked";
  } else if (lens_agrees_ && camera_ == prior_.camera) {
    result.reason = "the images agree with the calibration";
  } else if (camera_ == prior_.camera) {
    result.reason = "the images do not determine the camera";
  } else {
    result.is_learned = true;
    result.contradicts_prior = result.contradicts_prior || (is_told_ && !lens_agrees_);
  }
  return std::move(learned_);
}

}  // namespace mono3d::calibration
