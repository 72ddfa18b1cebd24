// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-bench: reconstruction and evaluation of many sequences, in the form of the paper's tables;
// what a depth map, its fusion and a tracked frame cost; how well places are known again and
// flights placed on the earth; and what each part of the depth stage and of fusion buys.

#include <cstdio>
#include <filesystem>

#include "bench/ablation_command.h"
#include "bench/fusion_ablation_command.h"
#include "bench/measurements.h"
#include "bench/place_command.h"
#include "bench/position_command.h"
#include "bench/suite.h"
#include "bench/suite_page.h"
#include "bench/tracking_command.h"
#include "common/json_file.h"
#include "common/tool.h"
#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/core/options.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  SuiteOptions suite;
  std::string markdown;  // empty: nowhere
  std::string json;
  std::string report;
};

void WriteResults(const Arguments& arguments, const std::vector<SequenceResult>& results) {
  const std::filesystem::path output = arguments.suite.output;
  const std::string name = NameOfFolder(arguments.suite.folder);
  const Page page = SuitePage(results, name, output);
  const std::filesystem::path json =
      arguments.json.empty() ? output / "bench.json" : std::filesystem::path(arguments.json);
  const std::filesystem::path report =
      arguments.report.empty() ? output / "index.html" : std::filesystem::path(arguments.report);
  WriteFileAtomically(json, JsonText(ToJson(results, name)));
  WriteFileAtomically(report, ToHtml(page));
  if (!arguments.markdown.empty()) WriteFileAtomically(arguments.markdown, ToMarkdown(page));
  for (const Table& table : page.sections[0].tables) {
    std::printf("%s\n", ToText(table).c_str());
  }
  std::printf("report %s\n", report.c_str());
}

int RunBench(const Arguments& arguments) {
  RequireOption(arguments.suite.time_limit_s >= 0, "time-limit", "seconds, 0: none",
                arguments.suite.time_limit_s);
  RequireOption(arguments.suite.max_depth_m >= 0, "max-depth", "a depth in metres, 0: no bound",
                arguments.suite.max_depth_m);
  CreateOutputFolder(arguments.suite.output);
  CatchStopSignals();
  const std::vector<SequenceResult> results =
      RunSuite(arguments.suite, [](const SequenceResult& result) {
        std::fprintf(stderr, "%s: %s\n", result.name.c_str(),
                     result.is_success ? "success" : result.reason.c_str());
      });
  if (results.empty()) throw Error("stopped before the first sequence was done");
  WriteResults(arguments, results);
  return 0;
}

void AddSuiteArguments(CLI::App& app, Arguments& arguments) {
  SuiteOptions& suite = arguments.suite;
  app.add_option("DIR", suite.folder, "folder of sequence folders")->required();
  app.add_option("-o,--output", suite.output, "folder for the runs, bench.json and index.html")
      ->capture_default_str();
  app.add_option("--only", suite.only, "pattern of the sequences' names: \"hut_*\"");
  app.add_flag("--resume", suite.resume, "keep what earlier calls with the same options made");
  app.add_option("--time-limit", suite.time_limit_s, "for each program, in seconds; 0: none")
      ->capture_default_str();
  app.add_option("--max-depth", suite.max_depth_m,
                 "leave out true depths beyond, in metres (the paper: 300); 0: none")
      ->capture_default_str();
  app.add_option("--markdown", arguments.markdown, "write the tables as Markdown");
  app.add_option("--json", arguments.json, "default: bench.json in the output folder");
  app.add_option("--report", arguments.report, "default: index.html in the output folder");
  app.add_option("OPTIONS", suite.reconstruct_arguments,
                 "after --: options for mono3d-reconstruct");
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool(
      "mono3d-bench",
      "Reconstructs and evaluates many sequences and sets the figures beside the paper's,\n"
      "or measures what a depth map, its fusion with a large model or a tracked frame costs,\n"
      "how well places are known again, how well positions place a flight on the earth,\n"
      "or an ablation of the depth stage or of fusion.\n"
      "Example: mono3d-bench suite sequences/ -o bench/ --markdown benchmarks.md",
      ToolKind::kPlain);
  tool.app().require_subcommand(1);
  CLI::App& suite = *tool.app().add_subcommand("suite", "all sequences of a folder");
  CLI::App& tracking = *tool.app().add_subcommand(
      "tracking", "tracking alone: share of frames, errors, what a frame costs");
  Arguments arguments;
  AddSuiteArguments(suite, arguments);
  const DepthCommand depth(tool.app());
  const FusionCommand fusion(tool.app());
  const FlightCommand flight(tool.app());
  const PlaceCommand places(tool.app());
  const PositionCommand positions(tool.app());
  CLI::App& ablation =
      *tool.app().add_subcommand("ablation", "the depth stage without each of its parts in turn");
  AblationArguments ablation_arguments;
  AddAblationArguments(ablation, ablation_arguments);
  CLI::App& fusion_ablation = *tool.app().add_subcommand(
      "fusion-ablation", "what registration and confidence buy, on depth maps of one tracked run");
  FusionAblationArguments fusion_ablation_arguments;
  AddFusionAblationArguments(fusion_ablation, fusion_ablation_arguments);
  TrackingBenchOptions tracking_options;
  std::string tracking_json;
  AddTrackingArguments(tracking, tracking_options, tracking_json);
  return tool.Run(argc, argv, [&] {
    if (depth.is_asked_for()) return depth.Run();
    if (fusion.is_asked_for()) return fusion.Run();
    if (flight.is_asked_for()) return flight.Run();
    if (places.is_asked_for()) return places.Run();
    if (positions.is_asked_for()) return positions.Run();
    if (ablation.parsed()) return RunAblation(ablation_arguments);
    if (fusion_ablation.parsed()) return RunFusionAblation(fusion_ablation_arguments);
    if (tracking.parsed()) return RunTrackingBench(tracking_options, tracking_json);
    return RunBench(arguments);
  });
}
