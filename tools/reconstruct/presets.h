// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "common/tool.h"
#include "mono3d/pipeline/stages.h"
#include "reconstruct/working_size.h"

namespace mono3d::tools {

// What mono3d-reconstruct shows of its options, and what its presets set.

// --fast and --best, which change the defaults of other options; docs/guide.md says what they give
// and cost.
void SetFast(PipelineOptions& options);
void SetBest(PipelineOptions& options, WorkingSize& size);

void AddPresets(Tool& tool, PipelineOptions& options, WorkingSize& size);

// --max-memory: of the surfels, three quarters of it on the device, the rest beside it.
void AddMemoryLimit(Tool& tool, PipelineOptions& options);

// Of --help: the long names of the dozen options that matter.
std::vector<std::string> ShownOptions();

inline constexpr const char* kReconstructExamples =
    "  mono3d-reconstruct flight.mp4 -o model             a video; its camera is learned\n"
    "  mono3d-reconstruct photos/ --photos -o model       photographs in any order\n"
    "  mono3d-reconstruct flight/ --camera camera.yaml -o model --mesh\n"
    "  mono3d-reconstruct flight.mp4 --fast -o preview    a first look\n"
    "  mono3d-reconstruct flight.mp4 --live -o model      at the pace of the camera";

}  // namespace mono3d::tools
