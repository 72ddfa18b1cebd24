// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/products/finished_run.h"

namespace mono3d {

// The views of the depth maps of a run: keyframes of the sparse model, and those that the tracker
// has dropped from it since, by run.json and model_trajectory.txt. `file` is empty where the image
// is not there.
std::vector<RunImage> DepthViews(const FinishedRun& run);

}  // namespace mono3d
