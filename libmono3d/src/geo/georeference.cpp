// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/georeference.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include "geo/position_fit.h"
#include "geo/position_pairs.h"
#include "geo/position_priors.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kFewestFixes = 3;
constexpr double kClockStep_s = 0.5;  // of the offsets that are tried
// Of those around the offset that was found, twice: cameras sway within a second or two, so that
// half a second on there may be a worse one; and between images a second apart or a quarter, the
// path is not straight, so that a step of least squares may end beside the best.
constexpr double kFinerBy = 5;
constexpr double kFinestClockStep_s = kClockStep_s / (kFinerBy * kFinerBy);
// An offset that leaves most fixes without a camera fits the rest easily.
constexpr double kLeastShareOfPairs = 0.7;

double RobustSigma(std::vector<double> values) {
  constexpr double kSigmaOfMad = 1.4826;  // of a normal distribution
  const double median = UpperMedianOrZero(values);
  for (double& value : values) value = std::abs(value - median);
  return kSigmaOfMad * UpperMedianOrZero(std::move(values));
}

// Fixes that are no measurement of where the receiver was: far off all others, a jump that the next
// ones do not share, or the same place over and over while the camera moves.
class OutlierSearch {
 public:
  OutlierSearch(const std::vector<PositionPair>& pairs, std::vector<Vector3d> residuals,
                const PlacementPriors& priors, double scale)
      : pairs_(pairs), residuals_(std::move(residuals)), priors_(priors), scale_(scale) {}

  std::vector<bool> Used() {
    used_.assign(pairs_.size(), true);
    for (Eigen::Index axis = 0; axis < (priors_.has_vertical ? 3 : 2); ++axis) {
      const double typical_m = axis < 2 ? priors_.horizontal_m : priors_.vertical_m;
      DropFarOnes(Axis(axis), typical_m);
      DropFarOnes(Jumps(axis), typical_m);
    }
    DropFrozen();
    return std::move(used_);
  }

 private:
  static constexpr double kFar = kFarPosition;

  std::vector<double> Axis(Eigen::Index axis) const {
    std::vector<double> values;
    for (const Vector3d& residual : residuals_) values.push_back(residual[axis]);
    return values;
  }

  // From the median of the fixes around: what wanders slowly goes out.
  std::vector<double> Jumps(Eigen::Index axis) const {
    constexpr std::size_t kNumBeside = 3;
    const std::vector<double> values = Axis(axis);
    std::vector<double> jumps;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t first = i < kNumBeside ? 0 : i - kNumBeside;
      const std::size_t last = std::min(values.size() - 1, i + kNumBeside);
      jumps.push_back(values[i] - UpperMedian(std::vector<double>(
                                      values.begin() + static_cast<std::ptrdiff_t>(first),
                                      values.begin() + static_cast<std::ptrdiff_t>(last) + 1)));
    }
    return jumps;
  }

  void DropFarOnes(const std::vector<double>& values, double typical_m) {
    // Receivers that filter change by less from one fix to the next than they are off by.
    constexpr double kLeastShare = 0.2;
    const double sigma_m = std::max(RobustSigma(values), kLeastShare * typical_m);
    const double median = UpperMedianOrZero(values);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::abs(values[i] - median) > kFar * sigma_m) used_[i] = false;
    }
  }

  void DropFrozen() {
    const std::vector<bool> are_frozen = AreFrozen(pairs_, scale_, kFar * priors_.horizontal_m);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (are_frozen[i]) used_[i] = false;
    }
  }

  const std::vector<PositionPair>& pairs_;
  std::vector<Vector3d> residuals_;
  const PlacementPriors& priors_;
  double scale_;
  std::vector<bool> used_;
};

// Offsets that are tried first.
std::vector<double> ClockOffsets(std::span<const PositionedCamera> cameras,
                                 const PositionTrack& track, const GeoreferenceOptions& options) {
  const bool is_known = track.clock == PositionClock::kImages || options.clock_offset_sigma_s == 0;
  if (is_known) return {options.clock_offset_s};
  double first_s = options.clock_offset_s - options.max_clock_offset_s;
  double last_s = options.clock_offset_s + options.max_clock_offset_s;
  if (track.clock == PositionClock::kUnix && options.clock_offset_s == 0) {
    // Nothing is known: wherever the track has all cameras, or the cameras have all of it.
    first_s = cameras.back().timestamp_s - track.fixes.back().time_s;
    last_s = cameras.front().timestamp_s - track.fixes.front().time_s;
    if (first_s > last_s) std::swap(first_s, last_s);
    first_s -= options.max_clock_offset_s;
    last_s += options.max_clock_offset_s;
  }
  constexpr double kMostTries = 20'000;
  const double step_s = std::max(kClockStep_s, (last_s - first_s) / kMostTries);
  std::vector<double> offsets;
  for (double offset_s = first_s; offset_s <= last_s; offset_s += step_s) {
    offsets.push_back(offset_s);
  }
  return offsets;
}

class GeoreferenceEstimate {
 public:
  GeoreferenceEstimate(std::span<const PositionedCamera> cameras, const PositionTrack& track,
                       const std::optional<UpDirection>& up, const GeoreferenceOptions& options)
      : cameras_(cameras),
        track_(track),
        options_(options),
        pairs_of_(cameras, track),
        priors_(PriorsFor(track, pairs_of_, up, options)) {}

  GeoreferenceResult Find() {
    if (!FindStart()) return {std::nullopt, reason_};
    if (priors_.up) RollUpright();
    if (!Settle()) return {std::nullopt, reason_};
    SearchClock();
    if (!IsDetermined()) return {std::nullopt, reason_};
    return {Result(), {}};
  }

 private:
  static constexpr int kMostRounds = 20;

  bool FindStart() {
    double best_m = std::numeric_limits<double>::max();
    std::size_t most_pairs = 0;
    const std::vector<double> offsets = ClockOffsets(cameras_, track_, options_);
    for (const double offset_s : offsets) {
      most_pairs = std::max(most_pairs, pairs_of_.At(offset_s).size());
    }
    if (most_pairs < kFewestFixes) {
      reason_ = track_.clock == PositionClock::kImages
                    ? "fewer than three images have a position by their name"
                    : "fewer than three positions fall into the time of the tracked images";
      return false;
    }
    for (const double offset_s : offsets) {
      const std::vector<PositionPair> pairs = pairs_of_.At(offset_s);
      if (pairs.size() < kFewestFixes || static_cast<double>(pairs.size()) <
                                             kLeastShareOfPairs * static_cast<double>(most_pairs)) {
        continue;
      }
      MapPlacement placement = FitRobustly(pairs, priors_.horizontal_m);
      const double distance_m = MeanDistance(pairs, placement, priors_.has_vertical);
      if (!(distance_m < best_m) || !(placement.scale > 0)) continue;
      best_m = distance_m;
      placement_ = placement;
      placement_.clock_offset_s = offset_s;
      pairs_ = pairs;
    }
    if (!std::isfinite(placement_.scale) || best_m == std::numeric_limits<double>::max()) {
      reason_ = "all cameras with a position are in one place";
      return false;
    }
    if (track_.clock == PositionClock::kUnix && options_.clock_offset_s == 0) {
      priors_.clock_offset_s = placement_.clock_offset_s;  // nothing was known of it
    }
    return true;
  }

  bool Settle() {
    for (int round = 0; round < kMostRounds; ++round) {
      FindUsed();
      if (!Step()) return false;
      if (IsSmall(fit_->increment)) break;
    }
    return true;
  }

  struct Start {
    double excess = 0;  // ExcessOfFit, with what is known of the offset
    MapPlacement placement;
  };

  // From another offset, if that makes the fixes more likely with errors as large and as slow as
  // those of the settled fit. The first start is by mean distance, which with errors that wander is
  // a matter of chance: where the speed is even every offset fits but for turns and ends, which
  // other offsets leave without a camera.
  void SearchClock() {
    if (track_.clock == PositionClock::kImages || options_.clock_offset_sigma_s == 0) return;
    constexpr int kMostSearches = 3;
    // Twice the logarithm of how much more likely another offset must be: ten times.
    constexpr double kClearly = 4.6;
    for (int search = 0; search < kMostSearches; ++search) {
      const auto settled = std::tuple(placement_, pairs_, used_, fit_);
      const PlacementFit noise = *fit_;
      const std::optional<Start> here =
          StartAt(placement_.clock_offset_s, kFinestClockStep_s, noise);
      const std::optional<Start> best = MostLikelyStart(noise);
      if (!here || !best || best->excess > here->excess - kClearly) return;
      placement_ = best->placement;
      if (Settle()) {
        const std::optional<Start> there =
            StartAt(placement_.clock_offset_s, kFinestClockStep_s, noise);
        if (there && there->excess <= here->excess - kClearly) continue;
      }
      std::tie(placement_, pairs_, used_, fit_) = settled;
      return;
    }
  }

  std::optional<Start> MostLikelyStart(const PlacementFit& noise) const {
    std::optional<Start> best;
    const auto look_around = [&](double middle_s, double reach_s, double step_s) {
      for (double offset_s = middle_s - reach_s; offset_s <= middle_s + reach_s;
           offset_s += step_s) {
        std::optional<Start> start = StartAt(offset_s, step_s, noise);
        if (start && (!best || start->excess < best->excess)) best = std::move(start);
      }
    };
    look_around(priors_.clock_offset_s, options_.max_clock_offset_s, kClockStep_s);
    look_around(placement_.clock_offset_s, kClockStep_s, kClockStep_s / kFinerBy);
    if (best) {
      look_around(best->placement.clock_offset_s, kClockStep_s / kFinerBy, kFinestClockStep_s);
    }
    return best;
  }

  // The most likely one within half a step.
  std::optional<Start> StartAt(double offset_s, double step_s, const PlacementFit& noise) const {
    // Of calling a fix an outlier, in squared residuals: more than the 8 (twice the negative
    // logarithm) that one in fifty is one, less than the 17 if outliers lie evenly within ten
    // standard deviations on each axis.
    constexpr double kCostOfOutlier = 10;
    const std::vector<PositionPair> pairs = pairs_of_.At(offset_s);
    if (pairs.size() < kFewestFixes ||
        static_cast<double>(pairs.size()) <
            kLeastShareOfPairs * static_cast<double>(pairs_.size())) {
      return std::nullopt;
    }
    Start start{0, FitRobustly(pairs, priors_.horizontal_m)};
    MapPlacement& placement = start.placement;
    if (!(placement.scale > 0)) return std::nullopt;
    placement.clock_offset_s = offset_s;
    if (priors_.up) {
      placement = RolledUpright(pairs, placement, priors_.up->up_map, priors_.horizontal_m,
                                priors_.has_vertical);
    }
    const std::vector<bool> used =
        OutlierSearch(pairs, ResidualsOf(pairs, placement, priors_.antenna_m), priors_,
                      placement.scale)
            .Used();
    PlacementPriors near = priors_;
    near.clock_offset_s = offset_s;
    near.clock_offset_sigma_s = step_s / 2;
    const std::optional<double> excess =
        ExcessOfFit(pairs, used, placement, near, noise.horizontal, noise.vertical);
    if (!excess) return std::nullopt;
    const double from_prior = (offset_s - priors_.clock_offset_s) / options_.clock_offset_sigma_s;
    start.excess = *excess + from_prior * from_prior +
                   kCostOfOutlier * static_cast<double>(std::ranges::count(used, false));
    return start;
  }

  // Of cameras along a line the roll is what `up` tells; of others that changes little.
  void RollUpright() {
    placement_ = RolledUpright(pairs_, placement_, priors_.up->up_map, priors_.horizontal_m,
                               priors_.has_vertical);
  }

  void FindUsed() {
    pairs_ = pairs_of_.At(placement_.clock_offset_s);
    used_ = OutlierSearch(pairs_, ResidualsOf(pairs_, placement_, priors_.antenna_m), priors_,
                          placement_.scale)
                .Used();
  }

  bool Step() {
    const auto num_used = static_cast<std::size_t>(std::ranges::count(used_, true));
    if (num_used < kFewestFixes) {
      reason_ = "fewer than three positions agree with the path of the camera";
      return false;
    }
    fit_ = FitStep(pairs_, used_, placement_, priors_);
    if (!fit_) {
      reason_ = "the positions lie on a line, and nothing tells which way is up";
      return false;
    }
    const double farthest_s = options_.max_clock_offset_s;
    placement_.Add(fit_->increment);
    placement_.clock_offset_s =
        std::clamp(placement_.clock_offset_s, priors_.clock_offset_s - farthest_s,
                   priors_.clock_offset_s + farthest_s);
    return true;
  }

  bool IsSmall(const MapPlacement::Increment& increment) const {
    constexpr double kOfSigma = 0.01;
    const MapPlacement::Increment sigma = fit_->covariance.diagonal().cwiseSqrt();
    return (increment.array().abs() <= kOfSigma * sigma.array() + 1e-12).all();
  }

  bool IsDetermined() {
    // Beyond, errors are no longer small against what they are errors of.
    constexpr double kLargestScaleSigma = 0.2;
    constexpr double kLargestAngleSigma = 0.35;  // rad
    const MapPlacement::Increment sigma = fit_->covariance.diagonal().cwiseSqrt();
    const auto percent = [](double value) { return std::to_string(std::lround(100 * value)); };
    if (!(sigma[6] < kLargestScaleSigma)) {
      reason_ =
          "the flight is too short for positions that err this much: the scale would be off "
          "by " +
          percent(sigma[6]) + " %";
      return false;
    }
    if (!(sigma.segment<3>(3).maxCoeff() < kLargestAngleSigma)) {
      reason_ =
          "the positions do not tell the directions: off by " +
          std::to_string(std::lround(sigma.segment<3>(3).maxCoeff() * 180 / std::numbers::pi)) +
          " degrees";
      return false;
    }
    return true;
  }

  Georeference Result() const {
    Georeference result;
    result.origin = pairs_of_.origin();
    result.S_enu_map = placement_.ToSimilarity();
    result.has_altitude = pairs_of_.has_altitude();
    result.covariance = fit_->covariance;
    const MapPlacement::Increment sigma = fit_->covariance.diagonal().cwiseSqrt();
    result.position_sigma_m = sigma.head<3>();
    result.tilt_sigma_rad = sigma.segment<2>(3).maxCoeff();
    result.heading_sigma_rad = sigma[5];
    result.scale_sigma = sigma[6];
    result.clock_offset_s = placement_.clock_offset_s;
    result.clock_offset_sigma_s = priors_.clock_offset_sigma_s > 0 ? sigma[7] : 0;
    result.horizontal = fit_->horizontal;
    if (priors_.has_vertical) result.vertical = fit_->vertical;
    AddResiduals(result);
    return result;
  }

  void AddResiduals(Georeference& result) const {
    const std::vector<PositionPair> pairs = pairs_of_.At(placement_.clock_offset_s);
    const std::vector<Vector3d> residuals = ResidualsOf(pairs, placement_, priors_.antenna_m);
    double horizontal = 0;
    double vertical = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      // The last step may have taken a fix over the end of the flight.
      const bool is_used = i >= used_.size() || used_[i];
      Vector3d enu_m = residuals[i];
      if (!priors_.has_vertical) enu_m.z() = 0;
      const PositionFix& fix = track_.fixes[pairs[i].fix];
      result.residuals.push_back({pairs[i].fix, pairs[i].time_s, enu_m, !is_used, fix.image});
      if (track_.has_image_times) result.residuals.back().taken_s = fix.time_s;
      if (!is_used) continue;
      ++result.num_used;
      horizontal += enu_m.head<2>().squaredNorm();
      vertical += enu_m.z() * enu_m.z();
    }
    const auto count = static_cast<double>(std::max<std::size_t>(1, result.num_used));
    result.rms_horizontal_m = std::sqrt(horizontal / count);
    result.rms_vertical_m = std::sqrt(vertical / count);
  }

  std::span<const PositionedCamera> cameras_;
  const PositionTrack& track_;
  const GeoreferenceOptions& options_;
  PositionPairs pairs_of_;
  PlacementPriors priors_;
  MapPlacement placement_;
  std::vector<PositionPair> pairs_;
  std::vector<bool> used_;
  std::optional<PlacementFit> fit_;
  std::string reason_;
};

}  // namespace

void GeoreferenceOptions::Visit(OptionVisitor& visit) {
  visit("clock_offset_s", clock_offset_s, "time of an image minus that of its position, seconds");
  visit("clock_offset_sigma_s", clock_offset_sigma_s,
        "how well that is known (standard deviation), seconds; 0: exactly");
  visit("max_clock_offset_s", max_clock_offset_s, "looked for up to this far from it, seconds");
  visit("antenna_right_m", antenna_right_m, "of the antenna from the camera, to its right, metres");
  visit("antenna_down_m", antenna_down_m, "the same, downwards in its image");
  visit("antenna_forward_m", antenna_forward_m, "the same, where it looks");
}

void GeoreferenceOptions::Validate() const {
  RequireOption(std::isfinite(clock_offset_s), "positions.clock_offset_s", "a number",
                clock_offset_s);
  RequireOption(std::isfinite(clock_offset_sigma_s) && clock_offset_sigma_s >= 0,
                "positions.clock_offset_sigma_s", "at least 0", clock_offset_sigma_s);
  RequireOption(std::isfinite(max_clock_offset_s) && max_clock_offset_s >= 0,
                "positions.max_clock_offset_s", "at least 0", max_clock_offset_s);
  for (const double antenna_m : {antenna_right_m, antenna_down_m, antenna_forward_m}) {
    constexpr double kFarthest_m = 100;
    RequireOption(std::abs(antenna_m) <= kFarthest_m, "positions.antenna_*_m", "-100 to 100",
                  antenna_m);
  }
}

GeoreferenceResult EstimateGeoreference(std::span<const PositionedCamera> cameras,
                                        const PositionTrack& track,
                                        const std::optional<UpDirection>& up,
                                        const GeoreferenceOptions& options) {
  options.Validate();
  if (cameras.size() < kFewestFixes) return {std::nullopt, "fewer than three cameras"};
  if (track.fixes.size() < kFewestFixes) return {std::nullopt, "fewer than three positions"};
  return GeoreferenceEstimate(cameras, track, up, options).Find();
}

std::optional<UpDirection> UpFromGimbal(std::span<const PositionedCamera> cameras,
                                        const PositionTrack& track) {
  // A gimbal holds its angles to some tenths of a degree; its level goes with the drone's own.
  constexpr double kSigma_rad = 1.0 * std::numbers::pi / 180;
  std::vector<Vector3d> ups;
  const PositionPairs pairs_of(cameras, track);
  for (const PositionPair& pair : pairs_of.At(0)) {
    const std::optional<GimbalAngles>& gimbal = track.fixes[pair.fix].gimbal;
    if (!gimbal) continue;
    const double pitch = gimbal->pitch_deg * std::numbers::pi / 180;
    const double roll = gimbal->roll_deg * std::numbers::pi / 180;
    // Camera axes are x right, y down, z forward: rolled clockwise, then pitched upwards.
    const Vector3d up_cam(-std::sin(roll) * std::cos(pitch), -std::cos(roll) * std::cos(pitch),
                          std::sin(pitch));
    ups.push_back((pair.R_map_cam * up_cam).normalized());
  }
  if (ups.size() < kFewestFixes) return std::nullopt;
  // The mean of the directions, each weighted down by its distance (Weiszfeld).
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& up : ups) mean += up;
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    Vector3d next = Vector3d::Zero();
    mean.normalize();
    for (const Vector3d& up : ups) next += up / std::max(kSigma_rad, (up - mean).norm());
    mean = next;
  }
  return UpDirection{mean.normalized(), kSigma_rad};
}

}  // namespace mono3d
