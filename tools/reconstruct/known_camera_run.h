// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "reconstruct/reconstruct_run.h"

namespace mono3d::tools {

// With a camera that is known before, or learned from the input first.
ReconstructResult RunWithKnownCamera(const ReconstructRun& run);

}  // namespace mono3d::tools
