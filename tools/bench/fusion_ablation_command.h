// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/fusion_ablation.h"

namespace mono3d::tools {

// What `mono3d-bench fusion-ablation` was asked for; the files are empty where there is to be none.
struct FusionAblationArguments {
  FusionAblationOptions options;
  DeviceOptions device;
  std::string json;
  std::string markdown;
};

void AddFusionAblationArguments(CLI::App& app, FusionAblationArguments& arguments);
int RunFusionAblation(const FusionAblationArguments& arguments);

}  // namespace mono3d::tools
