// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/pipeline/run_writer.h"

namespace mono3d::tools {

// What a finding of the library means for the one who took the images.
struct Advice {
  std::string cause;   // a sentence without its full stop
  std::string remedy;  // the same
};

// Of a reason why a frame has no pose, or why there is no depth or no fusion. Both are empty where
// nothing better than the reason can be said.
Advice AdviceOf(std::string_view reason);

// Did the scene go out of sight, so that tracking began anew? A map also ends without that, where a
// turn on the spot leaves the scale open.
bool WasTrackLost(const PipelineCounts& counts);

// Of every reason that AdviceOf knows: the guide lists them.
std::vector<Advice> AllAdvice();

// What most likely made the largest model degraded or broken, by what the run knows of its camera,
// its maps and its depth maps. Empty where the model is good.
Advice AdviceOfModel(const Reconstruction& reconstruction, const RunRecord& record);

// "cause; remedy", or what there is of it.
std::string ToText(const Advice& advice);

}  // namespace mono3d::tools
