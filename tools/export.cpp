// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-export: a finished run in the forms that other programs take.

#include <filesystem>
#include <string>

#include "common/tool.h"
#include "export/product_list.h"
#include "mono3d/products/finished_run.h"

int main(int argc, char** argv) {
  using namespace mono3d;
  using namespace mono3d::tools;
  Tool tool("mono3d-export",
            "Writes a finished run in the forms that other programs take.\n"
            "Example: mono3d-export out --products las,dsm",
            ToolKind::kPlain);
  std::string folder, output, names = "all";
  CLI::App& app = tool.app();
  app.add_option("RUN", folder, "output folder of mono3d-reconstruct")->required();
  std::string products = "all";
  for (const Product& product : Products()) {
    products += "; " + product.name + ": " + product.description;
    if (product.add_options) product.add_options(app);
  }
  app.add_option("--products", names, "which, separated by commas: " + products)
      ->capture_default_str();
  app.add_option("-o,--output", output, "folder; left out: RUN/products");
  return tool.Run(argc, argv, [&] {
    const auto chosen = ChooseProducts(names);
    const FinishedRun run = ReadFinishedRun(folder);
    const std::filesystem::path target =
        output.empty() ? ProductFolderOf(folder) : std::filesystem::path(output);
    return WriteProducts(chosen, run, target) == 0 ? 0 : 1;
  });
}
