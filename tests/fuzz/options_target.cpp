// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "common/dotted_config.h"
#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"

namespace mono3d::fuzz {

void Options(std::string_view input) {
  static const InputFolder folder("options");
  const std::string file = folder.Write("options.ini", input);
  CLI::App app("", "fuzz");
  bool is_on = false;
  int number = 0;
  double size = 0;
  std::string text;
  app.add_option("--is-on", is_on);
  app.add_option("--stage.number", number);
  app.add_option("--stage.part.size", size);
  app.add_option("--text", text);
  app.set_config("--config", "", "");
  app.config_formatter(std::make_shared<tools::DottedConfig>());
  app.allow_config_extras(CLI::config_extras_mode::error);
  const char* const arguments[] = {"fuzz", "--config", file.c_str()};
  try {
    app.parse(3, arguments);
  } catch (const CLI::Error&) {  // how it refuses
  }
}

}  // namespace mono3d::fuzz
