// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/position_bench.h"

namespace mono3d::tools {

// The arguments of `mono3d-bench positions`, and what it does; empty file names: nowhere.
class PositionCommand {
 public:
  explicit PositionCommand(CLI::App& tool);
  bool is_asked_for() const { return app_.parsed(); }
  int Run() const;

 private:
  CLI::App& app_;
  PositionBenchOptions options_;
  std::string json_;
  std::string markdown_;
};

}  // namespace mono3d::tools
