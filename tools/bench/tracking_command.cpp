// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/tracking_command.h"

#include <cstdio>

#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/core/options.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {

void AddTrackingArguments(CLI::App& app, TrackingBenchOptions& tracking, std::string& json) {
  app.add_option("DIR", tracking.folder, "folder of a sequence")->required();
  app.add_option("--mean-depth", tracking.mean_depth_m,
                 "in metres, to give errors as its share; 0: from the true depth maps")
      ->capture_default_str();
  app.add_option("--json", json, "write the figures as JSON");
  Tool::AddOptions(app, ListOptions(tracking.source));
  Tool::AddOptions(app, ListOptions(tracking.tracking), "tracking.");
}

int RunTrackingBench(const TrackingBenchOptions& options, const std::string& json) {
  RequireOption(options.mean_depth_m >= 0, "mean-depth", "a length in metres, 0: not known",
                options.mean_depth_m);
  const TrackingBenchResult result = BenchTracking(options);
  if (!json.empty()) WriteFileAtomically(json, JsonText(ToJson(result)));
  std::printf("%s\n", ToText(ToTable(result)).c_str());
  return 0;
}

}  // namespace mono3d::tools
