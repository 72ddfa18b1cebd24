// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/depth_bench.h"
#include "bench/flight_bench.h"
#include "bench/fusion_bench.h"
#include "mono3d/gpu/device.h"

namespace mono3d::tools {

// The commands of mono3d-bench that measure what one stage costs. Each holds its arguments and must
// outlive the tool.
class DepthCommand {
 public:
  explicit DepthCommand(CLI::App& tool);
  bool is_asked_for() const { return app_.parsed(); }
  int Run() const;  // prints, and returns the exit status

 private:
  CLI::App& app_;
  DepthBenchOptions options_;
  DeviceOptions device_;
  std::string json_;  // empty: nowhere
};

class FusionCommand {
 public:
  explicit FusionCommand(CLI::App& tool);
  bool is_asked_for() const { return app_.parsed(); }
  int Run() const;

 private:
  CLI::App& app_;
  FusionBenchOptions options_;
  DeviceOptions device_;
  std::string json_;
};

class FlightCommand {
 public:
  explicit FlightCommand(CLI::App& tool);
  bool is_asked_for() const { return app_.parsed(); }
  int Run() const;

 private:
  CLI::App& app_;
  FlightBenchOptions options_;
  DeviceOptions device_;
};

}  // namespace mono3d::tools
