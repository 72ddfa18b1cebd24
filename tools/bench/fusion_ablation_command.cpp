// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/fusion_ablation_command.h"

#include <cstdio>

#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/core/options.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {

void AddFusionAblationArguments(CLI::App& app, FusionAblationArguments& arguments) {
  FusionAblationOptions& options = arguments.options;
  app.add_option("DIR", options.folders, "folders of sequences with true poses, depth and cloud")
      ->required();
  app.add_option("--pose-error", options.pose_error,
                 "of the worse poses: root mean square, as a share of the depth")
      ->capture_default_str();
  app.add_option("--only", options.only, "names of variants: \"no registration\"");
  app.add_option("--markdown", arguments.markdown, "write the tables as Markdown");
  app.add_option("--json", arguments.json, "write the figures as JSON");
  app.add_option("--device", arguments.device.device,
                 "Vulkan device: its index or part of its name");
  Tool::AddOptions(app, ListOptions(options.pipeline));
}

int RunFusionAblation(const FusionAblationArguments& arguments) {
  const FusionAblationOptions& options = arguments.options;
  RequireOption(options.pose_error > 0 && options.pose_error < 1, "pose-error",
                "a share of the depth, in (0, 1)", options.pose_error);
  options.pipeline.Validate();
  const FusionAblationResult result = RunFusionAblation(options, arguments.device);
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
