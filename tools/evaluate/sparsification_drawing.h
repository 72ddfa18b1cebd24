// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/evaluation/confidence_calibration.h"
#include "report/page.h"

namespace mono3d::tools {

// The error that is left over the share of pixels dropped: by confidence, and by the oracle.
Figure SparsificationFigure(const ConfidenceCalibration& confidence);

}  // namespace mono3d::tools
