// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/calibration_verdict.h"

#include <algorithm>
#include <cmath>

namespace mono3d {
namespace {

constexpr double kMinSigmas = 3;
// Good calibrations of one camera differ by as much (see decision 17).
constexpr double kMinChange = 0.3e-3;
// Less is nothing to a tracker (see decision 18).
constexpr double kMinReadoutChange_s = 1e-3;
// Left to the tracker, it costs about a tenth of a percent of the depth.
constexpr double kKnown = 0.005;

double ShutterChange_s(const RollingShutter& a, const RollingShutter& b) {
  if (a.reads_columns == b.reads_columns) return std::abs(a.readout_s - b.readout_s);
  return std::max(std::abs(a.readout_s), std::abs(b.readout_s));
}

}  // namespace

CalibrationVerdict Judge(const CameraCalibration& calibration, bool is_last_chance) {
  const CameraModel& camera = calibration.posterior.camera;
  const double side_px = std::max(camera.width, camera.height);
  const double change_s = ShutterChange_s(calibration.prior.camera.shutter, camera.shutter);
  const bool has_other_lens =
      calibration.change_px >
      std::max(kMinSigmas * calibration.uncertainty_px, kMinChange * side_px);
  const bool has_other_shutter =
      change_s > std::max(kMinSigmas * calibration.posterior.readout_sigma_s, kMinReadoutChange_s);
  const bool is_known =
      calibration.num_rounds > 0 && calibration.uncertainty_px <= kKnown * side_px;
  if (calibration.is_learned && (has_other_lens || has_other_shutter)) {
    return is_known || is_last_chance ? CalibrationVerdict::kBetter
                                      : CalibrationVerdict::kUndecided;
  }
  return is_known ? CalibrationVerdict::kAgrees : CalibrationVerdict::kUndecided;
}

}  // namespace mono3d
