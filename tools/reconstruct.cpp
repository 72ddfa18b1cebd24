// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-reconstruct: from an image folder, a glob, a video or a camera to a coloured surfel model.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "common/camera_choice.h"
#include "common/input_check.h"
#include "common/progress.h"
#include "common/summary.h"
#include "common/tool.h"
#include "common/warnings.h"
#include "export/run_products.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/live_input.h"
#include "mono3d/io/output_file.h"
#include "mono3d/pipeline/next_views.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/ground_control.h"
#include "reconstruct/known_camera_run.h"
#include "reconstruct/learned_camera_run.h"
#include "reconstruct/output_folder.h"
#include "reconstruct/output_options.h"
#include "reconstruct/placed_together.h"
#include "reconstruct/positions.h"
#include "reconstruct/presets.h"
#include "reconstruct/processing.h"
#include "reconstruct/reconstruct_arguments.h"
#include "reconstruct/reconstruct_run.h"
#include "run_report/next_views_kml.h"
#include "run_report/next_views_report.h"
#include "run_report/run_report.h"

namespace mono3d::tools {
namespace {

ReconstructResult MakeRun(const ReconstructRun& run) {
  return LearnsCameraLive(run.arguments) ? RunWhileLearningCamera(run) : RunWithKnownCamera(run);
}

// A run whose page cannot be written is none the worse.
void WriteReport(const ReconstructRun& run, const Reconstruction& reconstruction,
                 const std::string& why_no_model, const std::filesystem::path& folder) {
  const double start_ms = ProcessCpuMs();
  try {
    NextViews next;
    if (!reconstruction.maps.empty()) next = ProposeNextViews(reconstruction.maps.front());
    if (next.surface_su2 > 0) {
      WriteNextViews(folder, next);
      WriteNextViewsKml(folder, reconstruction.maps.front(), next, !run.record.are_photos);
    }
    WriteRunReport(folder, {.reconstruction = reconstruction,
                            .record = run.record,
                            .notes = run.notes,
                            .command = run.arguments.command,
                            .no_model = why_no_model,
                            .warnings = NotedWarnings(),
                            .next_views = std::move(next)});
    Log(LogLevel::kDebug,
        "the report took " + std::to_string(ProcessCpuMs() - start_ms) + " ms of processor time");
  } catch (const std::exception& error) {
    Log(LogLevel::kWarning, std::string("no report: ") + error.what());
  }
}

// `instead_of`: of an earlier run of the same images; the new one takes its place where it is
// better, and is removed where not.
RunOutcome ReconstructInto(OutputFolder& output, ReconstructArguments& arguments,
                           const std::shared_ptr<Device>& device, const CameraModel& prior_camera,
                           std::optional<GroundControl> control, RunRecord& record,
                           const RunOutcome* instead_of) {
  const double start_ms = WallClockMs();
  std::optional<HeldWarnings> held;
  if (instead_of != nullptr) held.emplace();
  const DepthFileOptions depth_files = DepthFilesOf(arguments.written, arguments.pipeline.is_live);
  std::optional<RunJournal> journal;
  if (arguments.resumes) journal.emplace(output.of_run(), record);
  const bool resumes = journal && journal->HasState();
  if (arguments.finishes && !resumes) {
    throw Error("there is no run to finish in " + arguments.output +
                ": without --finish it starts from its beginning");
  }
  if (arguments.resumes && !resumes) {
    std::printf("nothing to resume in %s: the run starts from its beginning\n",
                arguments.output.c_str());
  }
  const RunWriter writer = resumes ? RunWriter::OfRunToResume(output.of_run(), depth_files)
                                   : RunWriter(output.of_run(), depth_files);
  if (!journal && arguments.with_journal) journal.emplace(output.of_run(), record);
  SurfelStorageOptions& surfels = arguments.pipeline.fusion.storage;
  if (surfels.folder.empty()) surfels.folder = output.of_run().string();
  if (!arguments.source.hidden.empty()) {
    WriteMask(output.of_run().string(), arguments.source.hidden);
  }
  StageTimes times;
  FramesSoFar frames;
  WriteFailures failures;
  RunNotes notes;
  EarlierParts earlier;
  arguments.view.Open();
  const ReconstructRun run{
      arguments,
      device,
      writer,
      times,
      record,
      frames,
      failures,
      notes,
      arguments.view,
      output.of_run(),
      prior_camera,
      {arguments.live ? 0 : TellOfTurn(arguments.input),
       FindPositions(arguments.input, arguments.positions, arguments.pipeline.is_live),
       arguments.positions.georeference, std::move(control)},
      journal ? &*journal : nullptr,
      earlier,
      start_ms};
  const ReconstructResult result = MakeRun(run);
  failures.NoteIn(record);
  if (record.are_photos || record.is_sparse_video) {
    arguments.pipeline.fusion.registration.moves = false;  // as it was; in run.json too
  }
  if (arguments.live) record.live_input = arguments.live->Report();
  record.stages = times.Snapshot();
  record.wall_s = earlier.wall_s + 1e-3 * (WallClockMs() - start_ms);
  if (instead_of != nullptr) record.wall_s += instead_of->wall_s;
  record.cpu_s = earlier.cpu_s + 1e-3 * ProcessCpuMs();
  NoteErrorOf(record, [&] { writer.WriteRecord(result.reconstruction, record); });
  const std::string why_no_model = WhyNoModel(result.reconstruction);
  const RunOutcome outcome = OutcomeOf(result.reconstruction, record, why_no_model);
  if (instead_of != nullptr && !outcome.IsBetterThan(*instead_of)) {
    output.Discard();
    return outcome;
  }
  if (held) held->LetGo();
  WriteReport(run, result.reconstruction, why_no_model, output.of_run());
  if (journal && record.end == RunEnd::kFinished) journal->Remove();
  if (outcome.is_whole) output.TakePlaceOfEarlier();
  PrintSummary(result.reconstruction, record, output.of_run() / "model.ply");
  if (record.live_input) TellOfLiveInput(*record.live_input);
  for (const MapReconstruction& map : result.reconstruction.maps) {
    const std::string line = GeoreferenceLine(map);
    if (!line.empty()) std::printf("%s\n", line.c_str());
    const std::string control_lines = GroundControlLines(map);
    if (!control_lines.empty()) std::printf("%s\n", control_lines.c_str());
  }
  if (journal && record.end != RunEnd::kFinished && journal->last_frame() >= 0) {
    std::printf("the same command with --resume goes on after frame %lld\n",
                static_cast<long long>(journal->last_frame()));
  }
  if (record.end == RunEnd::kFailed) throw Error(record.error);
  return outcome;
}

struct MadeRun {
  RunOutcome outcome;
  std::string folder;
  std::string kept;  // what became of an earlier one, if there was any
};

MadeRun MakeRunInFolder(ReconstructArguments& arguments, const std::shared_ptr<Device>& device,
                        const CameraModel& camera, const std::optional<GroundControl>& control,
                        RunRecord record, const RunOutcome* instead_of) {
  OutputFolder output(arguments.output, arguments.resumes);
  MadeRun made;
  KeepingOnFailure(output, [&] {
    made.outcome = ReconstructInto(output, arguments, device, camera, control, record, instead_of);
    made.kept = output.Keep();
  });
  made.folder = output.of_run().string();
  return made;
}

// Once more, of images that could not be followed from one to the next. Says on stdout what came of
// it; what goes wrong in it costs nothing of the result that is there.
void PlaceTogether(ReconstructArguments& arguments, const std::shared_ptr<Device>& device,
                   const CameraModel& camera, const std::optional<GroundControl>& control,
                   RunRecord record, MadeRun& tracked) {
  const int stride = StrideOfPlacing(arguments, tracked.outcome);
  std::printf("%s\n", PlacedTogetherLine(tracked.outcome, stride).c_str());
  std::fflush(stdout);
  arguments.footage = Footage::kSparseVideo;
  if (stride > 1) {
    FrameSourceOptions& source = arguments.source;
    source.stride *= stride;
    source.max_frames = (source.max_frames + stride - 1) / stride;
    record.options = ListAll(arguments);
  }
  arguments.resumes = false;
  try {
    const MadeRun together =
        MakeRunInFolder(arguments, device, camera, control, record, &tracked.outcome);
    if (together.outcome.IsBetterThan(tracked.outcome)) {
      std::error_code ignored;
      if (!tracked.outcome.is_whole && tracked.folder != together.folder) {
        std::filesystem::remove_all(tracked.folder, ignored);
      }
      tracked = together;
    } else if (StopRequested()) {
      std::printf("stopped: the result of before stays\n");
    } else {
      std::printf("placed together, %zu images are in one map%s: the result of before stays\n",
                  together.outcome.num_in_model,
                  together.outcome.is_broken ? ", and the model is broken" : "");
    }
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string("placed together, the images make no model, the result of "
                                        "before stays: ") +
                                error.what());
  }
}

// Says on stdout which device it is, where there are others.
void TellOfDevice(const DeviceInfo& device) {
  const std::size_t num_devices = ListDevices().size();
  if (num_devices < 2) return;
  std::printf("device %d of %zu: %s (another one: --device, see --list-devices)\n", device.index,
              num_devices, device.name.c_str());
}

int Reconstruct(ReconstructArguments& arguments, const DeviceOptions& device_options) {
  PrepareForLive(arguments);
  arguments.pipeline.Validate();
  arguments.mesh.Validate();
  arguments.camera.calibration.Validate();
  arguments.self_calibration.Validate();
  arguments.positions.georeference.Validate();
  arguments.control.options.Validate();
  RequireKnownProducts(arguments.products);
  RequireSameCamera(arguments);
  if (arguments.finishes && !arguments.resumes) {
    throw UsageError("--finish is of a run that was broken off: give --resume as well");
  }
  if (arguments.resumes && arguments.pipeline.is_live) {
    throw UsageError("a live run cannot be resumed: its images have passed; leave out --resume");
  }
  if (!arguments.control.file.empty() && (arguments.pipeline.is_live || !arguments.map.empty())) {
    throw UsageError(
        "ground control points need images that are there from the beginning, in a map of their "
        "own: leave out --live or --map");
  }
  // What is wrong with the input is said before anything is done or written.
  std::optional<GroundControl> control = ReadGroundControl(arguments.control);
  arguments.source.Validate();
  arguments.size.Validate();
  if (arguments.pipeline.is_live) TakeEveryImageLive(arguments.source);
  arguments.live_input.Validate();
  arguments.live = ConnectWhereLive(arguments.input, arguments.live_input);
  const CameraModel camera =
      FindPriorOf(arguments.input, arguments.camera, arguments.live.get()).camera;
  if (arguments.map.empty() && !arguments.live) {
    RequireImagesOfPlaces(arguments.input, camera, arguments.source);
  }
  DeviceOptions own_device_options = device_options;
  own_device_options.yields = arguments.pipeline.is_live;
  // Loading a driver and its compiler takes as long as looking at the images.
  std::future<std::shared_ptr<Device>> opened_device = std::async(
      std::launch::async, [own_device_options] { return OpenDevice(own_device_options); });
  arguments.source.hidden = FindHidden(arguments.input, arguments.mask, camera, arguments.source,
                                       arguments.pipeline.is_live, kMaskName);
  if (!arguments.live) RequireOtherFolder(arguments.input, arguments.output);
  if (!arguments.save_map.empty()) RequireWritableFile(arguments.save_map);
  const std::shared_ptr<Device> device = opened_device.get();
  TellOfDevice(Info(*device));
  RunRecord record;
  record.input = WithoutPassword(arguments.input);
  record.camera = arguments.camera.file;
  record.device = Info(*device);
  record.options = ListAll(arguments);
  if (arguments.source.stride == kStrideByMotion) record.num_passed_over_images = 0;
  const std::string folder_of_surfels = arguments.pipeline.fusion.storage.folder;
  MadeRun made = MakeRunInFolder(arguments, device, camera, control, record, nullptr);
  const bool may_be_better = MayBePlacedTogether(arguments, made.outcome);
  if (may_be_better && ShowOtherPlaces(arguments, made.outcome)) {
    std::printf("%s\n", OtherPlacesLine(made.outcome).c_str());
  } else if (may_be_better) {
    arguments.pipeline.fusion.storage.folder = folder_of_surfels;
    PlaceTogether(arguments, device, camera, control, record, made);
  }
  if (!made.outcome.why_no_model.empty()) {
    throw Error(made.outcome.why_no_model + (made.kept.empty() ? "" : "; " + made.kept));
  }
  if (!made.kept.empty()) std::printf("%s\n", made.kept.c_str());
  return WriteRunProducts(made.outcome.is_whole ? arguments.products : "", made.folder);
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-reconstruct",
            "Makes a coloured 3D model from a video or photographs of one camera.");
  ReconstructArguments arguments;
  arguments.command = ShellCommand(argc, argv);
  tool.app()
      .add_option("INPUT", arguments.input,
                  "image folder, quoted glob (\"flight/*.jpg\"), video file, or a camera that "
                  "sends now: rtsp://, udp://, tcp:// or /dev/video0")
      ->required();
  tool.app().add_option("--camera", arguments.camera.file,
                        "calibration, as OpenCV, ROS, COLMAP, Kalibr, ORB-SLAM or nerfstudio write "
                        "it; without it the "
                        "camera is learned from the images");
  AddLensOption(tool.app(), arguments.camera);
  tool.app().add_flag("--camera-fixed", arguments.camera.is_held,
                      "hold the calibration, whatever the images say");
  tool.app()
      .add_option("-o,--output", arguments.output,
                  "folder for model.ply, trajectory.txt, depth/, sparse/ and run.json")
      ->required();
  tool.app().add_flag("--mesh", arguments.with_mesh,
                      "write mesh.ply as well: triangles through the surfels");
  tool.app().add_flag("--global-shutter-images,--undistorted-images",
                      arguments.with_global_shutter_images,
                      "write images_global_shutter/ as well: the keyframes' images without "
                      "distortion and as of a global shutter, as depth/ is of them; sparse/ is "
                      "then of them, too");
  AddRunProductOptions(tool.app(), arguments.products);
  AddOutputOptions(tool.app(), arguments.written);
  AddPositionOptions(tool.app(), arguments.positions);
  AddGroundControlOptions(tool.app(), arguments.control);
  tool.app().add_option("--map", arguments.map,
                        "map of an earlier run of the same camera, to go on in");
  tool.app().add_option("--save-map", arguments.save_map,
                        "file for the map, so that a later run can go on in it");
  tool.app().add_flag("--resume", arguments.resumes,
                      "go on with the run in the output folder that was broken off, with the same "
                      "arguments: from the last state in its journal");
  tool.app().add_flag("--finish", arguments.finishes,
                      "with --resume: make the model of what there is, without going on; the run "
                      "can still be resumed");
  tool.app().add_flag("--journal,!--no-journal", arguments.with_journal,
                      "keep the state of the run in journal/ of the output folder, every 4 s of "
                      "video, until the run is whole (default)");
  tool.app().add_flag(
      "--photos,!--video", arguments.photos,
      "the images are photographs in any order, or a video; else it is found out, and "
      "up to 400 images that cannot be followed are placed together, unless they are whole maps of "
      "places that have nothing in common");
  tool.app().add_flag("--live", arguments.pipeline.is_live,
                      "images come at the pace of their time stamps, as from a camera; nothing "
                      "waits for depth, what there is no time for is dropped and counted; a camera "
                      "that is not known, or not held by --camera-fixed, is learned meanwhile");
  AddPresets(tool, arguments.pipeline, arguments.size);
  AddMemoryLimit(tool, arguments.pipeline);
  tool.ShowInHelp(ShownOptions(), kReconstructExamples);
  arguments.view.AddOptions(tool.app());
  tool.AddOptions(mono3d::ListOptions(arguments.source));
  tool.AddOptions(mono3d::ListOptions(arguments.size));
  tool.AddOptions(mono3d::ListOptions(arguments.mask));
  tool.AddOptions(mono3d::ListOptions(arguments.mesh), "mesh.");
  tool.AddOptions(mono3d::ListOptions(arguments.camera.calibration), "calibration.");
  tool.AddOptions(mono3d::ListOptions(arguments.pipeline));
  tool.AddOptions(mono3d::ListOptions(arguments.self_calibration), "live.calibration.");
  tool.AddOptions(mono3d::ListOptions(arguments.live_input), "live.input.");
  tool.AddOptions(mono3d::ListOptions(arguments.positions.georeference), "positions.");
  tool.AddOptions(mono3d::ListOptions(arguments.control.options), "control.");
  return tool.Run(argc, argv, [&] { return Reconstruct(arguments, tool.common().device); });
}
