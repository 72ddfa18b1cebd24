// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "mono3d/products/finished_run.h"
#include "mono3d/products/map_axes.h"

namespace mono3d::tools {

// What all products of a survey have in common.
struct SurveyOptions {
  std::string crs;  // empty: the UTM zone of the origin
};

// Those of this process, which every product of a survey reads.
SurveyOptions& SurveyOptionsOfTool();

// Adds --crs, unless another product has.
void AddSurveyOptions(CLI::App& app);

// The axes of the products of a run. Says on stdout what they are, once for each run.
MapAxes TellAxes(const FinishedRun& run);

}  // namespace mono3d::tools
