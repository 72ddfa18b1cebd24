// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/place_command.h"

#include <cstdio>

#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/core/options.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {

PlaceCommand::PlaceCommand(CLI::App& tool)
    : app_(*tool.add_subcommand("places", "place recognition: recall of revisits, wrong places")) {
  app_.add_option("DIR", options_.folder, "folder of a sequence with true poses and depth")
      ->required();
  app_.add_option("--other", options_.others, "folders of sequences of other places");
  app_.add_option("--split", options_.split,
                  "first image that is asked for; those before make the map; 0: the middle one")
      ->capture_default_str();
  app_.add_option("--query-stride", options_.query_stride, "ask for every which image")
      ->capture_default_str();
  app_.add_option("--json", json_, "write the figures as JSON");
  app_.add_option("--markdown", markdown_, "write the tables as Markdown");
  Tool::AddOptions(app_, ListOptions(options_.source));
  Tool::AddOptions(app_, ListOptions(options_.tracking), "tracking.");
}

int PlaceCommand::Run() const {
  RequireOption(options_.split >= 0, "split", "an image, 0: the middle one", options_.split);
  RequireOption(options_.query_stride > 0, "query-stride", "1 or more", options_.query_stride);
  const PlaceBenchResult result = BenchPlaces(options_);
  std::string markdown;
  for (const Table& table : ToTables(result)) {
    std::printf("%s\n", ToText(table).c_str());
    markdown += ToMarkdown(table) + "\n";
  }
  if (!json_.empty()) WriteFileAtomically(json_, JsonText(ToJson(result)));
  if (!markdown_.empty()) WriteFileAtomically(markdown_, markdown);
  return 0;
}

}  // namespace mono3d::tools
