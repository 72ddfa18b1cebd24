// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/product_list.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <sstream>
#include <system_error>

#include "common/tool.h"
#include "export/dense.h"
#include "export/depth.h"
#include "export/las.h"
#include "export/mesh.h"
#include "export/nerfstudio.h"
#include "export/rasters.h"
#include "export/splats.h"
#include "mono3d/core/error.h"
#include "mono3d/core/printable.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

// A folder may have come with a run from elsewhere: through a link in it, what is written would
// take the place of files outside.
void RequireNoLink(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_symlink(path, ignored)) return;
  throw Error(ErrorParts{
      .what = "a link where products are written: remove it, or give a folder by --output",
      .where = path,
      .expected = {},
      .found = {},
      .code = ErrorCode::kIo});
}

}  // namespace

std::filesystem::path ProductFolderOf(const std::filesystem::path& run) {
  std::filesystem::path folder = run / "products";
  RequireNoLink(folder);
  std::error_code not_there;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, not_there)) {
    RequireNoLink(entry.path());
  }
  return folder;
}

std::vector<Product>& Products() {
  static std::vector<Product> products = {
      LasProduct(),        LocalPlyProduct(), SurfaceModelProduct(),
      OrthophotoProduct(), MeshProduct(),     SplatsProduct(),
      NerfstudioProduct(), DepthProduct(),    DenseProduct()};
  return products;
}

std::vector<const Product*> ChooseProducts(const std::string& names) {
  std::vector<const Product*> chosen;
  if (names == "all") {
    for (const Product& product : Products()) chosen.push_back(&product);
    return chosen;
  }
  std::istringstream list(names);
  for (std::string name; std::getline(list, name, ',');) {
    const auto found = std::ranges::find(Products(), name, &Product::name);
    if (found == Products().end()) {
      std::string known = "all";
      for (const Product& product : Products()) known += ", " + product.name;
      throw UsageError("--products: expected " + known + ", found \"" + name + "\"" +
                       (name == "all" ? " beside others: it stands alone" : ""));
    }
    if (std::ranges::find(chosen, &*found) == chosen.end()) chosen.push_back(&*found);
  }
  return chosen;
}

int WriteProducts(std::span<const Product* const> products, const FinishedRun& run,
                  const std::filesystem::path& folder) {
  CreateOutputFolder(folder);
  int num_failed = 0;
  for (const Product* product : products) {
    try {
      for (const std::filesystem::path& file : product->write(run, folder)) {
        std::printf("%s\n", file.c_str());
      }
    } catch (const std::exception& error) {  // of this product alone
      ++num_failed;
      std::fprintf(stderr, "%s: %s\n", product->name.c_str(), Printable(WordsOf(error)).c_str());
    }
  }
  return num_failed;
}

}  // namespace mono3d::tools
