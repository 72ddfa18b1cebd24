// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/calibration_verdict.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

CameraCalibration Learned(double change_px, double uncertainty_px) {
  CameraCalibration calibration;
  calibration.prior = calibration.posterior = DefaultCameraPrior(1000, 600);
  calibration.is_learned = true;
  calibration.num_rounds = 2;
  calibration.change_px = change_px;
  calibration.uncertainty_px = uncertainty_px;
  return calibration;
}

TEST(CalibrationVerdict, NeedsAChangeBeyondTheUncertainty) {
  EXPECT_EQ(Judge(Learned(50, 2), false), CalibrationVerdict::kBetter);
  EXPECT_EQ(Judge(Learned(5, 2), false), CalibrationVerdict::kAgrees);
  // No two good calibrations of a camera are nearer.
  EXPECT_EQ(Judge(Learned(0.29, 0.01), false), CalibrationVerdict::kAgrees);
  EXPECT_EQ(Judge(Learned(0.31, 0.01), false), CalibrationVerdict::kBetter);
}

TEST(CalibrationVerdict, WaitsForMoreImagesWhileTheyKnowLittle) {
  EXPECT_EQ(Judge(Learned(100, 6), false), CalibrationVerdict::kUndecided);
  EXPECT_EQ(Judge(Learned(100, 6), true), CalibrationVerdict::kBetter);
  EXPECT_EQ(Judge(Learned(5, 6), true), CalibrationVerdict::kUndecided);
}

TEST(CalibrationVerdict, TakesTheShutterAlone) {
  CameraCalibration calibration = Learned(0, 0.1);
  calibration.posterior.camera.shutter.readout_s = 0.02;
  calibration.posterior.readout_sigma_s = 0.001;
  EXPECT_EQ(Judge(calibration, false), CalibrationVerdict::kBetter);
  calibration.posterior.readout_sigma_s = 0.007;
  EXPECT_EQ(Judge(calibration, false), CalibrationVerdict::kAgrees);
}

TEST(CalibrationVerdict, OfWhatWasNotTrackedIsNone) {
  CameraCalibration calibration = Learned(0, 0);
  calibration.is_learned = false;
  EXPECT_EQ(Judge(calibration, true), CalibrationVerdict::kAgrees);
  calibration.num_rounds = 0;
  EXPECT_EQ(Judge(calibration, true), CalibrationVerdict::kUndecided);
}

}  // namespace
}  // namespace mono3d
