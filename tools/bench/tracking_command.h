// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/tracking_bench.h"

namespace mono3d::tools {

// The arguments of `mono3d-bench tracking`, and what it does; `json` is a file, empty: none.
void AddTrackingArguments(CLI::App& app, TrackingBenchOptions& tracking, std::string& json);
int RunTrackingBench(const TrackingBenchOptions& options, const std::string& json);

}  // namespace mono3d::tools
