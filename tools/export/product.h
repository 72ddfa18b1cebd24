// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "mono3d/products/finished_run.h"

namespace mono3d::tools {

// A form in which other programs take a model, as --products names it. Each is in a file of its
// own, tools/export/NAME.cpp, and in the list of product_list.cpp.
struct Product {
  std::string name;         // "las"
  std::string description;  // one line for --help
  // Adds the options that are this product's alone; may be empty.
  std::function<void(CLI::App& app)> add_options;
  // Writes its files into the folder and returns their paths. Throws Error; a product that the run
  // has not what it takes for throws one that says so, and the others are written all the same.
  std::function<std::vector<std::filesystem::path>(const FinishedRun& run,
                                                   const std::filesystem::path& folder)>
      write;
};

}  // namespace mono3d::tools
