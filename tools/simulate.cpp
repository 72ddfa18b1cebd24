// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-simulate: from a scene, a flight and a camera to a sequence with its truth.

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>

#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/core/timing.h"
#include "simulate/frame_progress.h"
#include "simulate/sequence_folder.h"
#include "simulate/suite_run.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string output;
  std::string suite;
  std::string only;
  bool dry_run = false;
  synthetic::SequenceOptions sequence;
  SequenceFileOptions files;
};

bool IsGiven(const CLI::App& app, const std::string& option) {
  return app.get_option("--" + option)->count() > 0;
}

// --seed stands for every seed that is not given for itself.
void SpreadSeed(const CLI::App& app, synthetic::SequenceOptions& options) {
  if (!IsGiven(app, "scene.seed")) options.scene.seed = options.seed;
  if (!IsGiven(app, "flight.unsteadiness.seed")) options.flight.unsteadiness.seed = options.seed;
  if (!IsGiven(app, "sensor.seed")) options.render.sensor.seed = options.seed;
}

// A suite says itself what is in its sequences.
constexpr std::array<const char*, 13> kSuiteOptions = {"seed",
                                                       "max-frames",
                                                       "depth-stride",
                                                       "cloud-voxel",
                                                       "cloud-max-depth-m",
                                                       "depth-form",
                                                       "jpeg-quality",
                                                       "camera.width",
                                                       "camera.height",
                                                       "uncalibrated",
                                                       "video.codec",
                                                       "video.keep",
                                                       "video.bit_rate_mbit_per_s"};

void RefuseOtherOptions(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_single_name();
    const bool is_of_sequence =
        option->get_group() == "Input" || option->get_group().compare(0, 5, "Stage") == 0;
    if (!is_of_sequence || option->count() == 0) continue;
    if (std::find(kSuiteOptions.begin(), kSuiteOptions.end(), name) != kSuiteOptions.end())
      continue;
    throw UsageError({"a suite chooses this option itself", "--" + name, {}, {}});
  }
}

// The lens stays the same: what is in pixels goes along with the size.
void SetWidth(synthetic::SequenceCameraOptions& camera, int width) {
  const double scale = static_cast<double>(width) / camera.width;
  camera.width = width;
  camera.focal_px *= scale;
  camera.offset_x_px *= scale;
}
void SetHeight(synthetic::SequenceCameraOptions& camera, int height) {
  camera.offset_y_px *= static_cast<double>(height) / camera.height;
  camera.height = height;
}

void TakeFileOptions(const CLI::App& app, const SequenceFileOptions& given,
                     synthetic::SuiteSequence& sequence) {
  if (IsGiven(app, "jpeg-quality")) sequence.jpeg_quality = given.jpeg_quality;
  if (IsGiven(app, "uncalibrated")) sequence.uncalibrated = given.uncalibrated;
  synthetic::VideoOptions& video = sequence.video;
  if (IsGiven(app, "video.codec")) video.codec = given.video.codec;
  if (IsGiven(app, "video.keep")) video.keep = given.video.keep;
  if (IsGiven(app, "video.bit_rate_mbit_per_s")) {
    video.bit_rate_mbit_per_s = given.video.bit_rate_mbit_per_s;
  }
  // A video of those that the suite has as photos.
  if (IsGiven(app, "video.codec") && video.IsOn()) sequence.jpeg_quality = 0;
}

// The suite with what the command line says of all its sequences.
std::vector<synthetic::SuiteSequence> PlanSuite(const CLI::App& app, const Arguments& arguments) {
  RefuseOtherOptions(app);
  const synthetic::SequenceOptions& given = arguments.sequence;
  auto suite = SelectSequences(synthetic::BuildSuite(arguments.suite, given.seed), arguments.only);
  for (synthetic::SuiteSequence& sequence : suite) {
    synthetic::SequenceOptions& options = sequence.options;
    if (IsGiven(app, "max-frames")) options.max_frames = given.max_frames;
    if (IsGiven(app, "depth-stride")) options.depth_stride = given.depth_stride;
    if (IsGiven(app, "cloud-voxel")) options.cloud_voxel = given.cloud_voxel;
    if (IsGiven(app, "cloud-max-depth-m")) options.cloud_max_depth_m = given.cloud_max_depth_m;
    if (IsGiven(app, "camera.width")) SetWidth(options.camera, given.camera.width);
    if (IsGiven(app, "camera.height")) SetHeight(options.camera, given.camera.height);
    TakeFileOptions(app, arguments.files, sequence);
  }
  return suite;
}

void Film(const synthetic::SequenceOptions& options, const SequenceFileOptions& files,
          const std::filesystem::path& folder) {
  const double start_ms = WallClockMs();
  const double start_cpu_ms = ProcessCpuMs();
  SequenceRun run;
  {
    FrameProgress progress(std::filesystem::absolute(folder).filename());
    run = WriteSequence(options, files, folder, [&](int num_done, int num_frames) {
      progress.Show(num_done, num_frames);
      return !StopRequested();
    });
  }
  if (!IsComplete(run.record)) {
    throw Error({"stopped; the same command goes on from here", folder, {}, {}});
  }
  std::printf(
      "%s: %d images (%d made now), mean depth %.1f m, %d points; %.1f s (processor %.1f s)\n",
      folder.c_str(), run.record["images"].get<int>(), run.num_rendered,
      run.record["mean_depth_m"].get<double>(), run.record["cloud"]["points"].get<int>(),
      1e-3 * (WallClockMs() - start_ms), 1e-3 * (ProcessCpuMs() - start_cpu_ms));
  std::fflush(stdout);
}

int SimulateSuite(const CLI::App& app, const Arguments& arguments) {
  const std::vector<synthetic::SuiteSequence> suite = PlanSuite(app, arguments);
  std::fputs((PlanTable(suite) + "\nplanned, over flat ground\n").c_str(), stdout);
  std::fputs(FlightTable(synthetic::PlanFlights(suite), 0).c_str(), stdout);
  std::fflush(stdout);
  if (arguments.dry_run) return 0;
  for (const synthetic::SuiteSequence& sequence : suite) {
    SequenceFileOptions files = arguments.files;
    files.jpeg_quality = sequence.jpeg_quality;
    files.video = sequence.video;
    files.uncalibrated = sequence.uncalibrated;
    Film(sequence.options, files, std::filesystem::path(arguments.output) / sequence.name);
  }
  std::fputs(("\nas filmed\n" + FolderTable(suite, arguments.output)).c_str(), stdout);
  return 0;
}

int Simulate(const CLI::App& app, Arguments arguments) {
  if (arguments.output.empty() && !arguments.dry_run) {
    throw UsageError({"no folder to write to", "--output", "-o DIR", "nothing"});
  }
  CatchStopSignals();
  if (!arguments.suite.empty()) return SimulateSuite(app, arguments);
  if (!arguments.only.empty()) throw UsageError({"needs --suite", "--only", {}, {}});
  SpreadSeed(app, arguments.sequence);
  if (arguments.dry_run) {
    std::fputs(
        PlanTable({{.name = "sequence", .options = arguments.sequence, .video = {}}}).c_str(),
        stdout);
    return 0;
  }
  Film(arguments.sequence, arguments.files, arguments.output);
  return 0;
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-simulate",
            "Films a made-up scene: images, with the true poses, depth and surface.\n"
            "Example: mono3d-simulate -o flight/ --scene.kind town --flight.kind orbit",
            ToolKind::kWithoutDevice);
  Arguments arguments;
  CLI::App& app = tool.app();
  app.add_option("-o,--output", arguments.output,
                 "folder of the sequence; with --suite, of a folder for each sequence");
  app.add_option("--suite", arguments.suite, "paper51, quick or cameras: many sequences at once");
  app.add_option("--only", arguments.only,
                 "only the suite's sequences with names like \"*_town_*\"");
  app.add_flag("--dry-run", arguments.dry_run, "print what would be flown and end");
  tool.AddOptions(mono3d::ListOptions(arguments.sequence));
  tool.AddOptions(mono3d::ListOptions(arguments.files));
  return tool.Run(argc, argv, [&] { return Simulate(app, arguments); });
}
