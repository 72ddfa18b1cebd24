// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/tool.h"
#include "mono3d/products/finished_run.h"

namespace mono3d::tools {

// A form in which other programs take a model, as --products names it. Each is in a file of its
// own, tools/export/NAME.cpp, and in the list of product.cpp.
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

// All of them, in the order in which they are written.
std::vector<Product>& Products();

// Those with these names ("las,dsm"), or all of them for "all". Throws UsageError.
std::vector<const Product*> ChooseProducts(const std::string& names);

// Writes them one after the other, and says of each what was written or why it was not. Returns how
// many could not be written.
int WriteProducts(std::span<const Product* const> products, const FinishedRun& run,
                  const std::filesystem::path& folder);

}  // namespace mono3d::tools
