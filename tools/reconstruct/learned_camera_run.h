// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "reconstruct/reconstruct_run.h"

namespace mono3d::tools {

// A camera that may be wrong cannot be learned before the images come.
bool LearnsCameraLive(const ReconstructArguments& arguments);

// Live, with a camera that is learned meanwhile.
ReconstructResult RunWhileLearningCamera(const ReconstructRun& run);

}  // namespace mono3d::tools
