// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/run_products.h"

#include "export/product_list.h"
#include "export/survey_options.h"

namespace mono3d::tools {

void AddRunProductOptions(CLI::App& app, std::string& names) {
  std::string known = "all";
  for (const Product& product : Products()) known += ", " + product.name;
  app.add_option("--products", names,
                 "files for other programs, into products/, once the run is whole: " + known +
                     ", separated by commas; mono3d-export has their options");
  AddSurveyOptions(app);
}

void RequireKnownProducts(const std::string& names) {
  if (!names.empty()) (void)ChooseProducts(names);
}

int WriteRunProducts(const std::string& names, const std::filesystem::path& folder) {
  if (names.empty()) return 0;
  const FinishedRun run = ReadFinishedRun(folder);
  return WriteProducts(ChooseProducts(names), run, ProductFolderOf(folder)) == 0 ? 0 : 1;
}

}  // namespace mono3d::tools
