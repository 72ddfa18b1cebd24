// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "synthetic/suite_sequence.h"

namespace mono3d::synthetic {

// The sequences of the suite "cameras".
std::vector<SuiteSequence> BuildCameras(int seed);

}  // namespace mono3d::synthetic
