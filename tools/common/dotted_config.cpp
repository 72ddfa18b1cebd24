// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/dotted_config.h"

#include <utility>

namespace mono3d::tools {

std::vector<CLI::ConfigItem> DottedConfig::from_config(std::istream& input) const {
  std::vector<CLI::ConfigItem> options;
  for (CLI::ConfigItem& item : CLI::ConfigBase::from_config(input)) {
    if (item.name == "++" || item.name == "--") continue;  // a section begins or ends
    if (!item.parents.empty()) item.name = CLI::detail::join(item.parents, ".") + "." + item.name;
    item.parents.clear();
    options.push_back(std::move(item));
  }
  return options;
}

}  // namespace mono3d::tools
