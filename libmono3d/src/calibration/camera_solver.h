// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "calibration/camera_problem.h"

namespace mono3d::calibration {

// Adjusts all unknowns of the problem by the method of Levenberg and Marquardt, with weights from
// the residuals before. `min_gain`: the relative gain below which a step is the last.
// O(points * images per point^2 + images^3) a step.
void Solve(CameraProblem& problem, double min_gain);

}  // namespace mono3d::calibration
