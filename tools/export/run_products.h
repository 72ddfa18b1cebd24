// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

namespace mono3d::tools {

// --products and --crs of a program that makes the run itself. `names` must outlive `app`.
void AddRunProductOptions(CLI::App& app, std::string& names);

// Throws UsageError where a product of that name is not known; empty: none is asked for.
void RequireKnownProducts(const std::string& names);

// Writes the products of the run in the folder into its products/. Returns the exit status: 1 where
// one of them could not be written, which is said; the run is whole either way.
int WriteRunProducts(const std::string& names, const std::filesystem::path& folder);

}  // namespace mono3d::tools
