// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "mono3d/pipeline/pipeline.h"

namespace mono3d {

// Adds the counts of depth maps and the model.
void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts);

// Counts a reason. Reasons that differ in their figures alone are counted together, and the figures
// become ranges: "62 matches, 100 needed" and "58 matches, 100 needed" are "58 to 62 matches, 100
// needed", twice. O(reasons so far).
void CountReason(const std::string& reason, std::int64_t times,
                 std::map<std::string, std::int64_t>& reasons);

}  // namespace mono3d
