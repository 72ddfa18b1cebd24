// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/ablation.h"

namespace mono3d::tools {

// What `mono3d-bench ablation` was asked for; the files are empty where there is to be none.
struct AblationArguments {
  AblationOptions options;
  DeviceOptions device;
  std::string json;
  std::string markdown;
};

void AddAblationArguments(CLI::App& app, AblationArguments& arguments);
int RunAblation(const AblationArguments& arguments);

}  // namespace mono3d::tools
