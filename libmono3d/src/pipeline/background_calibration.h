// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "pipeline/capture_buffer.h"

namespace mono3d {

using CalibrateFunction =
    std::function<CameraCalibration(const CameraPrior&, const FootageOpener&)>;

// Runs `calibrate` in a thread that yields to others, and waits for it. Throws what it throws; once
// `is_stopped` it has nothing to read any more.
CameraCalibration CalibrateInBackground(const CalibrateFunction& calibrate,
                                        const CameraPrior& prior,
                                        std::shared_ptr<const std::vector<CapturedFrame>> footage,
                                        const std::atomic<bool>& is_stopped);

}  // namespace mono3d
