// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "mono3d/calibration/camera_calibration.h"

namespace mono3d::tools {

// The images were asked, and leave a calibration that was told as it is.
bool AgreesWithCalibration(const CameraCalibration& calibration);

// For people: one line for each group of parameters, with standard deviations and whether the
// images determine it, and one of the residuals.
std::string CalibrationText(const CameraCalibration& calibration);

// For programs.
nlohmann::json CalibrationJson(const CameraCalibration& calibration);

// Writes calibration.json, residuals.png and residuals_by_radius.png; the folder is made. Throws
// Error when a file cannot be written.
void WriteCalibrationReport(const std::filesystem::path& folder,
                            const CameraCalibration& calibration);

}  // namespace mono3d::tools
