// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/position_command.h"

#include <cstdio>
#include <filesystem>

#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/core/options.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {

PositionCommand::PositionCommand(CLI::App& tool)
    : app_(*tool.add_subcommand(
          "positions", "flights placed on the earth by drawn positions: errors beside the bound")) {
  options_.output = "positions";
  app_.add_option("DIR", options_.sequences, "folders of sequences with true poses")->required();
  app_.add_option("-o,--output", options_.output,
                  "folder for the positions that are drawn and for positions.json")
      ->capture_default_str();
  app_.add_option("--kinds", options_.kinds,
                  "wander (1 Hz, 3 m over 60 s), white (5 Hz, 1 m), rtk (5 Hz, 3 cm, stated)")
      ->delimiter(',');
  app_.add_option("--draws", options_.num_draws, "for each sequence and kind")
      ->capture_default_str();
  app_.add_option("--seed", options_.seed, "of the first draw")->capture_default_str();
  app_.add_option("--outlier-share", options_.draw.outlier_share, "of the positions")
      ->capture_default_str();
  app_.add_option("--outlier", options_.draw.outlier_m,
                  "standard deviation on each axis of what these are off by, in metres")
      ->capture_default_str();
  app_.add_option("--max-clock-offset", options_.draw.max_clock_offset_s,
                  "drawn evenly up to this either way, in seconds")
      ->capture_default_str();
  app_.add_flag(
      "--models", options_.with_models,
      "make a model with the first draw of rtk, and compare it with cloud.ply as it lies");
  app_.add_option("--json", json_, "default: positions.json in the output folder");
  app_.add_option("--markdown", markdown_, "write the tables as Markdown");
  Tool::AddOptions(app_, ListOptions(options_.tracking), "tracking.");
}

int PositionCommand::Run() const {
  RequireOption(options_.num_draws > 0, "draws", "1 or more", options_.num_draws);
  RequireOption(options_.draw.outlier_share >= 0 && options_.draw.outlier_share < 1,
                "outlier-share", "at least 0, below 1", options_.draw.outlier_share);
  RequireOption(options_.draw.outlier_m >= 0, "outlier", "metres", options_.draw.outlier_m);
  RequireOption(options_.draw.max_clock_offset_s > 0, "max-clock-offset", "seconds, above 0",
                options_.draw.max_clock_offset_s);
  for (const std::string& kind : options_.kinds) static_cast<void>(ReceiverKindOf(kind));
  CreateOutputFolder(options_.output);
  CatchStopSignals();
  const std::vector<PositionRun> runs = BenchPositions(options_, [](const PositionRun& run) {
    std::fprintf(stderr, "%s, %s, %d: %s\n", run.sequence.c_str(), run.receiver.c_str(), run.seed,
                 run.followed.is_placed() ? "placed" : run.followed.reason.c_str());
  });
  if (runs.empty()) throw Error("stopped before the first run was done");
  std::string markdown;
  for (const Table& table : ToTables(runs)) {
    std::printf("%s\n", ToText(table).c_str());
    markdown += ToMarkdown(table) + "\n";
  }
  const std::filesystem::path json = json_.empty()
                                         ? std::filesystem::path(options_.output) / "positions.json"
                                         : std::filesystem::path(json_);
  WriteFileAtomically(json, JsonText(ToJson(runs)));
  if (!markdown_.empty()) WriteFileAtomically(markdown_, markdown);
  return 0;
}

}  // namespace mono3d::tools
