// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <istream>
#include <vector>

namespace mono3d::tools {

// The form of --config. The names of our options have dots. "[depth.sgm]" and "p1 = 10" below it
// say "depth.sgm.p1 = 10": CLI11 would look for subcommands of these names.
class DottedConfig : public CLI::ConfigBase {
 public:
  DottedConfig() { parentSeparator('\0'); }

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
};

}  // namespace mono3d::tools
