// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/ablation_command.h"

#include <cstdio>

#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/core/options.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {

void AddAblationArguments(CLI::App& app, AblationArguments& arguments) {
  AblationOptions& options = arguments.options;
  app.add_option("DIR", options.folders, "folders of sequences with true poses and depth")
      ->required();
  app.add_option("--bundles", options.num_bundles, "of each sequence, spread over it")
      ->capture_default_str();
  app.add_option("--step", options.step,
                 "images from one of a bundle to the next; 0: chosen by the selector")
      ->capture_default_str();
  app.add_option("--only", options.only, "names of variants: \"SGM, not SGM^sn\"");
  app.add_option("--markdown", arguments.markdown, "write the tables as Markdown");
  app.add_option("--json", arguments.json, "write the figures as JSON");
  app.add_option("--device", arguments.device.device,
                 "Vulkan device: its index or part of its name");
  Tool::AddOptions(app, ListOptions(options.depth), "depth.");
}

int RunAblation(const AblationArguments& arguments) {
  const AblationOptions& options = arguments.options;
  RequireOption(options.num_bundles >= 1, "bundles", "at least 1", options.num_bundles);
  RequireOption(options.step >= 0, "step", "images, or 0: chosen by the selector", options.step);
  const AblationResult result = RunAblation(options, arguments.device);
  std::string markdown;
  for (const Table& table : ToTables(result)) {
    std::printf("%s\n", ToText(table).c_str());
    markdown += ToMarkdown(table) + "\n";
  }
  if (!arguments.json.empty()) WriteFileAtomically(arguments.json, JsonText(ToJson(result)));
  if (!arguments.markdown.empty()) WriteFileAtomically(arguments.markdown, markdown);
  return 0;
}

}  // namespace mono3d::tools
