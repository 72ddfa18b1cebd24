// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "mono3d/pipeline/pipeline.h"

namespace mono3d {

// Adds the counts of depth maps and the model.
void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts);

// The reason without its figures, so that equal causes are counted together: "62 matches, 100
// needed" and "63 matches, 100 needed" become "# matches, # needed".
std::string ReasonClass(const std::string& reason);

}  // namespace mono3d
