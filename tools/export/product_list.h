// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "export/product.h"

namespace mono3d::tools {

// All of them, in the order in which they are written.
std::vector<Product>& Products();

// Those with these names ("las,dsm"), or all of them for "all". Throws UsageError.
std::vector<const Product*> ChooseProducts(const std::string& names);

// The folder for the products in that of a run. Throws Error where it, or anything in it, is a
// link.
std::filesystem::path ProductFolderOf(const std::filesystem::path& run);

// Writes them one after the other, and says of each what was written or why it was not. Returns how
// many could not be written.
int WriteProducts(std::span<const Product* const> products, const FinishedRun& run,
                  const std::filesystem::path& folder);

}  // namespace mono3d::tools
