// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-reconstruct: from an image folder, a glob, a video or a camera to a coloured surfel model.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "common/camera_choice.h"
#include "common/input_check.h"
#include "common/photo_cameras.h"
#include "common/progress.h"
#include "common/summary.h"
#include "common/tool.h"
#include "export/run_products.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/camera_metadata.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/live_input.h"
#include "mono3d/io/output_file.h"
#include "mono3d/pipeline/georeferencing.h"
#include "mono3d/pipeline/images_of_run.h"
#include "mono3d/pipeline/map_file.h"
#include "mono3d/pipeline/next_views.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "mono3d/pipeline/self_calibrating_pipeline.h"
#include "reconstruct/adopted_files.h"
#include "reconstruct/footage.h"
#include "reconstruct/ground_control.h"
#include "reconstruct/interim_results.h"
#include "reconstruct/live_run.h"
#include "reconstruct/output_folder.h"
#include "reconstruct/output_options.h"
#include "reconstruct/positions.h"
#include "reconstruct/presets.h"
#include "reconstruct/processing.h"
#include "reconstruct/resuming.h"
#include "reconstruct/run_journal.h"
#include "reconstruct/run_view.h"
#include "reconstruct/working_size.h"
#include "reconstruct/write_failures.h"
#include "run_report/next_views_kml.h"
#include "run_report/next_views_report.h"
#include "run_report/run_report.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string command;  // as it was given
  std::string input;
  CameraArguments camera;
  std::string output;
  std::string map;       // to go on in; empty: none
  std::string save_map;  // empty: not saved
  int photos = 0;        // 1: photographs in any order; -1: a video; 0: to be found out
  FrameSourceOptions source;
  WorkingSize size;
  LiveInputOptions live_input;
  std::shared_ptr<LiveInput> live;  // where `input` sends images now; else null
  PipelineOptions pipeline;
  SelfCalibrationOptions self_calibration;
  OutputArguments written;
  PositionArguments positions;
  GroundControlArguments control;
  bool with_global_shutter_images = false;
  bool with_mesh = false;
  MeshOptions mesh;
  std::string products;  // empty: none
  bool resumes = false;
  bool finishes = false;  // what there is, without going on
  bool with_journal = true;
  RunView view;
};

std::vector<OptionField> ListAll(Arguments& arguments) {
  OptionVisitor visitor;
  arguments.source.Visit(visitor);
  arguments.size.Visit(visitor);
  visitor.Group("calibration", arguments.camera.calibration);
  arguments.pipeline.Visit(visitor);
  visitor.Group("live.calibration", arguments.self_calibration);
  visitor.Group("live.input", arguments.live_input);
  visitor.Group("positions", arguments.positions.georeference);
  visitor.Group("control", arguments.control.options);
  return visitor.fields();
}

// A saved map has the camera of its run.
void RequireSameCamera(Arguments& arguments) {
  if (arguments.map.empty()) return;
  if (arguments.camera.file.empty()) {
    throw UsageError(
        ErrorParts{.what = "a saved map needs the camera of its run",
                   .where = "--map",
                   .expected = "--camera with its calibration, or with its learned_camera.yaml",
                   .found = {}});
  }
  arguments.camera.is_held = true;
}

std::unique_ptr<FrameSource> OpenFrames(const Arguments& arguments,
                                        const FrameSourceOptions& source,
                                        const CamerasOfImages& cameras) {
  if (!arguments.live) return OpenFrameSource(arguments.input, cameras, source);
  return arguments.live->Frames(cameras.cameras.front(), source, &StopRequested());
}

// How many frames will come, where that is known.
std::optional<std::int64_t> NumFrames(const FrameSource& source, const Arguments& arguments) {
  if (arguments.source.stride == kStrideByMotion) return std::nullopt;
  return source.num_frames();
}

// Says on stdout what was found out.
Footage FindFootage(const Arguments& arguments, StageTimes& times) {
  const char* unlike = arguments.pipeline.is_live    ? "--live"
                       : !arguments.map.empty()      ? "--map"
                       : !arguments.save_map.empty() ? "--save-map"
                                                     : nullptr;
  if (unlike != nullptr && arguments.photos > 0) {
    throw UsageError(std::string("photographs in any order have no ") + unlike);
  }
  if (unlike != nullptr || arguments.photos != 0) {
    return arguments.photos > 0 ? Footage::kPhotographs : Footage::kVideo;
  }
  const ScopedStageTimer timer(&times, "footage");
  return FootageOf(arguments.input, arguments.camera, arguments.source);
}

// Says on stdout what the photographs say of their cameras.
CamerasOfImages FindCameras(const Arguments& arguments, const FrameSourceOptions& source,
                            const std::vector<CameraGroup>& groups, const PositionsOfMap& positions,
                            const RunWriter& writer, StageTimes& times, RunRecord& record) {
  if (arguments.with_global_shutter_images) {
    throw UsageError("photographs of several cameras have no --global-shutter-images");
  }
  const ScopedStageTimer timer(&times, "calibration");
  PhotoCameras found = ChooseCamerasOfPhotos(arguments.input, groups, source, arguments.camera,
                                             arguments.pipeline.photos, positions);
  std::printf("the photographs are of %zu cameras, zooms or sizes\n", groups.size());
  for (std::size_t i = 0; i < found.of_run.size(); ++i) {
    const CameraOfRun& camera = found.of_run[i];
    std::printf("%s\n", PhotoCameraLine(i + 1, camera).c_str());
    if (camera.calibration.is_learned) writer.WriteCamera(found.cameras.cameras[i], i + 1);
  }
  record.cameras = std::move(found.of_run);
  return std::move(found.cameras);
}

// Says on stdout what the images say of their camera.
// `photos`: null where they are tracked one after the other.
CamerasOfImages FindCamera(const Arguments& arguments, const FrameSourceOptions& source,
                           const PhotoMapperOptions* photos, const PlaceOfRun& place,
                           const RunWriter& writer, StageTimes& times, RunRecord& record) {
  PositionsOfMap positions;
  if (photos != nullptr) {
    if (const std::optional<PipelinePositions> known = PositionsFor(place)) {
      positions = [known](const SparseModel& map) { return PositionsOfPhotos(map, *known); };
    }
  }
  if (record.are_photos) {
    const std::vector<CameraGroup> groups = GroupsOfInput(arguments.input);
    if (groups.size() > 1)
      return FindCameras(arguments, source, groups, positions, writer, times, record);
  }
  const ScopedStageTimer timer(&times, "calibration");
  CameraChoice choice = ChooseCamera(arguments.input, source, arguments.camera, photos, positions);
  if (choice.calibration) {
    const std::string line = CameraLine(*choice.calibration);
    if (!line.empty()) std::printf("%s\n", line.c_str());
    if (choice.calibration->is_learned) writer.WriteCamera(choice.camera);
    record.calibration = std::move(choice.calibration);
  }
  return {{choice.camera}};
}

// What all runs of the tool have.
struct Run {
  const Arguments& arguments;
  std::shared_ptr<Device> device;
  const RunWriter& writer;
  StageTimes& times;
  RunRecord& record;
  FramesSoFar& frames;
  WriteFailures& failures;
  RunNotes& notes;
  RunView& view;
  std::filesystem::path folder;  // that is written to
  CameraModel prior_camera;      // of the images as they were taken, as far as it is known before
  PlaceOfRun place;
  RunJournal* journal;  // null: none is kept
  EarlierParts& earlier;
  double start_ms;
};

struct Result {
  Reconstruction reconstruction;
  CamerasOfImages cameras;  // of the images as they are read, before --resize
  std::optional<CameraModel> depth_camera = {};
};

// `run`, `progress_line` and `images` must outlive it.
// `images`: null where the keyframes' images are not written yet.
PipelineObserver MakeObserver(const Run& run, ProgressLine& progress_line,
                              const std::shared_ptr<AdoptedFiles::Run>& files,
                              KeyframeImageWriter* images = nullptr) {
  PipelineObserver observer;
  observer.on_frame = [&, images](const PipelineProgress& progress) {
    if (images != nullptr) {
      const ScopedStageTimer timer(&run.times, "io/write_images");
      run.failures.Try("keyframe images", [&] {
        images->Decide(progress.frame_index, progress.tracking.is_keyframe);
      });
    }
    run.frames.Take(progress);
    run.notes.AddProgress(progress);
    progress_line.Show(progress);
  };
  observer.on_depth_map = [&run, files](const DepthMap& map, const FusionResult&) {
    const ScopedStageTimer timer(&run.times, "io/write_depth_map");
    run.failures.Try("depth maps", [&] { files->WriteDepthMap(map); });
    run.notes.AddDepthMap(map);
  };
  observer.on_keyframe = [&run, files](const Keyframe& keyframe) {
    run.frames.Take(keyframe);
    if (!run.arguments.with_global_shutter_images) return;
    const ScopedStageTimer timer(&run.times, "io/write_global_shutter_image");
    run.failures.Try("keyframe images", [&] { files->WriteKeyframeImage(keyframe.frame); });
  };
  run.view.AddTo(observer);
  return observer;
}

// The map of a run that came to its end takes the place of an earlier one, that of another does
// not.
void SaveMap(const Run& run, const Reconstruction& result, const Tracker& tracker) {
  std::string path = run.arguments.save_map;
  if (path.empty() || result.maps.empty()) return;
  std::error_code ignored;
  if (run.record.end != RunEnd::kFinished && std::filesystem::exists(path, ignored)) {
    std::printf("%s stays as it was: the map of this run is %s.unfinished\n", path.c_str(),
                path.c_str());
    path += ".unfinished";
  }
  SaveMapFile(tracker, path, result.maps.front().keyframes);
}

void NoteCamerasOfFiles(const Run& run, const Result& result) {
  std::vector<CameraOfFiles>& cameras = run.record.cameras_of_files;
  const bool is_undistorted = run.arguments.with_global_shutter_images;
  if (result.depth_camera) {
    const std::string depth = run.writer.writes_depth_maps() ? "depth/" : "";
    const std::string files =
        is_undistorted ? depth + (depth.empty() ? "" : ", ") + "images_global_shutter/, sparse/"
                       : depth;
    if (!files.empty()) cameras.push_back({files, *result.depth_camera});
  }
  if (is_undistorted) return;
  for (const CameraModel& camera : result.cameras.cameras) {
    cameras.push_back({"images/, sparse/", camera});
  }
}

// Of a video that is not played live: else images are dropped before the tracker has seen them.
bool MayWriteImagesEarly(const Run& run, Footage footage) {
  const Arguments& arguments = run.arguments;
  std::error_code ignored;
  return footage == Footage::kVideo && !arguments.pipeline.is_live &&
         !arguments.with_global_shutter_images && arguments.written.images != ImagePlacing::kNone &&
         std::filesystem::is_regular_file(arguments.input, ignored) &&
         MayPlaceImages(std::filesystem::path(arguments.output) / kImagesOfRun);
}

// `written`: frames whose images are there already.
void PlaceImages(const Run& run, const std::set<std::int64_t>& written,
                 Reconstruction& reconstruction) {
  const ScopedStageTimer timer(&run.times, "io/write_images");
  ImagePlacing placing = run.arguments.written.images;
  // A run that takes the place of an earlier one is made beside it.
  if (run.arguments.live) return;  // they are gone
  const std::filesystem::path images = std::filesystem::path(run.arguments.output) / kImagesOfRun;
  if (placing != ImagePlacing::kNone && !MayPlaceImages(images)) {
    std::printf("%s has other images in it: those of the keyframes are not written there\n",
                images.c_str());
    placing = ImagePlacing::kNone;
  }
  PlaceImagesOfRun(run.arguments.input, placing, run.folder, reconstruction, written);
}

// In the order of their worth; what cannot be written is noted, and the rest goes on.
void Write(const Run& run, Result& result, const Tracker& tracker,
           const std::set<std::int64_t>& written_images = {}) {
  Reconstruction& reconstruction = result.reconstruction;
  NoteCamerasOfFiles(run, result);
  NoteErrorOf(run.record, [&] { run.writer.WriteReconstruction(reconstruction); });
  if (!run.arguments.with_global_shutter_images) {
    NoteErrorOf(run.record, [&] { PlaceImages(run, written_images, reconstruction); });
  }
  NoteErrorOf(run.record, [&] {
    if (run.arguments.with_global_shutter_images) {
      run.writer.WriteSparseModelsOfKeyframeImages(reconstruction);
    } else {
      run.writer.WriteSparseModels(reconstruction, result.cameras);
    }
  });
  NoteErrorOf(run.record, [&] { SaveMap(run, reconstruction, tracker); });
  if (!run.arguments.with_mesh) return;
  const ScopedStageTimer timer(&run.times, "io/write_mesh");
  NoteErrorOf(run.record, [&] { run.writer.WriteMeshes(reconstruction, run.arguments.mesh); });
}

Pace PaceOf(const Arguments& arguments) {
  return arguments.live ? Pace::kAsTheyCome : Pace::kByTimeStamps;
}

// With a camera that is known before, or learned from the input first.
Result RunWithKnownCamera(const Run& run) {
  const Arguments& arguments = run.arguments;
  Result result;
  PipelineOptions options = arguments.pipeline;
  const Footage footage = FindFootage(arguments, run.times);
  FrameSourceOptions images_taken =
      arguments.size.Limit(arguments.source, footage, run.prior_camera);
  run.record.are_photos = footage == Footage::kPhotographs;
  run.record.is_sparse_video = footage == Footage::kSparseVideo;
  options.are_photos = footage != Footage::kVideo;
  options.photos.are_frames = footage == Footage::kSparseVideo;
  result.cameras =
      FindCamera(arguments, images_taken, options.are_photos ? &options.photos : nullptr, run.place,
                 run.writer, run.times, run.record);
  PlaceOfRun place = run.place;
  if (place.control) {
    FindSights(arguments.input, result.cameras, footage != Footage::kPhotographs, *place.control);
  }
  // A map of an earlier run keeps its shape as well as its axes.
  if (arguments.map.empty()) options.positions = PositionsFor(place);
  RunJournal* const journal = options.is_live || options.are_photos ? nullptr : run.journal;
  InputDigest input;
  const bool resumes = journal != nullptr && arguments.resumes && journal->HasState();
  std::optional<KeyframeImageWriter> images;
  if (MayWriteImagesEarly(run, footage)) {
    images.emplace(run.folder, resumes);
    images_taken.on_image = [&images](std::int64_t index, const cv::Mat& bgr) {
      images->Keep(index, bgr);
    };
  }
  std::unique_ptr<FrameSource> frames = OpenFrames(arguments, images_taken, result.cameras);
  if (journal != nullptr) frames = WithDigest(std::move(frames), input);
  std::unique_ptr<FrameSource> source = run.view.Watched(WithNotes(std::move(frames), run.notes));
  CatchStopSignals();
  ProgressLine progress_line(NumFrames(*source, arguments));
  AdoptedFiles files(run.writer);
  PipelineStages stages = CreateStages(options, run.device, &run.times);
  std::optional<WorldAxes> saved_axes;
  if (!arguments.map.empty()) {
    // What the journal has of the tracker has the map.
    const std::unique_ptr<Tracker> of_map = resumes ? CreateTracker(options.tracking) : nullptr;
    saved_axes = LoadMapFile(of_map ? *of_map : *stages.tracker, arguments.map);
  }
  const std::shared_ptr<AdoptedFiles::Run> files_of_run = files.BeginRun();
  Pipeline pipeline(std::move(stages),
                    MakeObserver(run, progress_line, files_of_run, images ? &*images : nullptr),
                    options);
  const JournaledRun journaled{pipeline, run.frames, run.notes, *files_of_run, run.times, input};
  if (resumes) {
    run.earlier = Resume(*journal, *source, journaled);
    run.record.resumed_after = run.earlier.last_frames;
    std::printf("resumed after frame %lld\n", static_cast<long long>(journal->last_frame()));
  }
  RunView::Watch watch(run.view, pipeline, NumFrames(*source, arguments));
  {
    InterimWriter::TakeSnapshot state;
    if (journal != nullptr) state = [&] { return pipeline.State(); };
    InterimWriter interim(
        run.writer, run.frames, run.record, [&] { return pipeline.Snapshot(); }, state);
    if (resumes && arguments.finishes) {
      run.record.end = RunEnd::kStopped;
    } else if (options.is_live) {
      PushFrames(std::move(source), PaceOf(arguments), pipeline, run.record);
    } else {
      std::int64_t last_frame = -1;
      const RunJournal::PutState put = [&](StateFolder& states) {
        const ScopedStageTimer timer(&run.times, "io/write_journal");
        return PutRun(journaled, run.earlier, 1e-3 * (WallClockMs() - run.start_ms), states);
      };
      ProcessFrames(*source, pipeline, run.times, run.record,
                    [&](std::int64_t frame_index, double timestamp_s) {
                      last_frame = frame_index;
                      if (journal != nullptr) journal->SaveIfDue(frame_index, timestamp_s, put);
                    });
      const bool is_stopped = run.record.end == RunEnd::kStopped;
      if (journal != nullptr && is_stopped && last_frame >= 0) journal->Save(last_frame, put);
      if (journal != nullptr) journal->Wait();
    }
    NoteErrorOf(run.record, [&] { interim.End(); });
  }
  result.reconstruction = FinishAfterAll(pipeline, run.record);
  NoteErrorOf(run.record, [&] { watch.End(); });
  result.depth_camera = files.DepthCamera();
  ChooseAxes(arguments.written, saved_axes, place, result.reconstruction);
  Write(run, result, pipeline.tracker(), images ? images->written() : std::set<std::int64_t>());
  return result;
}

// A camera that may be wrong cannot be learned before the images come.
bool LearnsCameraLive(const Arguments& arguments) {
  const bool is_held = arguments.camera.is_held && !arguments.camera.file.empty();
  return arguments.pipeline.is_live && !is_held;
}

// As it came out with images of another size: brings it to that of `prior`.
CameraCalibration AtSizeOf(const CameraPrior& prior, CameraCalibration calibration) {
  const double scale = static_cast<double>(prior.camera.width) / calibration.prior.camera.width;
  calibration.prior = prior;
  calibration.posterior = calibration.posterior.Resized(prior.camera.width, prior.camera.height);
  calibration.change_px *= scale;
  calibration.uncertainty_px *= scale;
  calibration.sigma_px *= scale;
  return calibration;
}

// Brings what was learned to the size of the images as taken, writes it, and says it on stdout.
void TellOfCamera(const Run& run, const CameraPrior& prior, Result& result) {
  SelfCalibration& learned = *result.reconstruction.self_calibration;
  learned.camera = learned.adopted_at_frame
                       ? learned.camera.Resized(prior.camera.width, prior.camera.height)
                       : prior.camera;
  if (learned.calibration) {
    learned.calibration = AtSizeOf(prior, *std::move(learned.calibration));
    // A saved map needs the camera of its run.
    const bool is_of_map = !run.arguments.save_map.empty();
    if (learned.calibration->is_learned) {
      const CameraModel& camera =
          is_of_map ? learned.camera : learned.calibration->posterior.camera;
      NoteErrorOf(run.record, [&] { run.writer.WriteCamera(camera); });
    }
  }
  run.record.calibration = learned.calibration;
  const std::string line = CameraLine(learned);
  if (!line.empty()) std::printf("%s\n", line.c_str());
  result.cameras = {{learned.camera}};
}

Result RunWhileLearningCamera(const Run& run) {
  const Arguments& arguments = run.arguments;
  const FrameSourceOptions images_taken =
      arguments.size.Limit(arguments.source, Footage::kVideo, run.prior_camera);
  const CameraPrior prior = FindPriorOf(arguments.input, arguments.camera, arguments.live.get());
  CameraModel as_taken = prior.camera;
  as_taken.distortion = {};
  as_taken.shutter = {};
  std::unique_ptr<FrameSource> source =
      run.view.Watched(WithNotes(OpenFrames(arguments, images_taken, {{as_taken}}), run.notes));
  CatchStopSignals();
  std::optional<ProgressLine> progress_line(NumFrames(*source, arguments));
  AdoptedFiles files(run.writer);
  SelfCalibrationSetup setup;
  setup.prior = prior.Resized(source->camera().width, source->camera().height);
  setup.create_stages = [&] { return CreateStages(arguments.pipeline, run.device, &run.times); };
  setup.create_observer = [&](const CameraModel&) {
    return MakeObserver(run, *progress_line, files.BeginRun());
  };
  setup.on_adoption = [&](const SelfCalibration&) {
    run.frames.Forget();
    files.RemoveBefore();
    run.view.NoteAdoption();
  };
  setup.calibrate = [&](const CameraPrior& known, const FootageOpener& open) {
    const ScopedStageTimer timer(&run.times, "calibration");
    return CalibrateCamera(known, open, arguments.camera.calibration);
  };
  PipelineOptions options = arguments.pipeline;
  options.positions = PositionsFor(run.place);
  SelfCalibratingPipeline pipeline(std::move(setup), options, arguments.self_calibration);
  RunView::Watch watch(run.view, pipeline, NumFrames(*source, arguments));
  {
    InterimWriter interim(run.writer, run.frames, run.record, [&] { return pipeline.Snapshot(); });
    PushFrames(std::move(source), PaceOf(arguments), pipeline, run.record);
    NoteErrorOf(run.record, [&] { interim.End(); });
  }
  Result result{FinishAfterAll(pipeline, run.record), {{prior.camera}}, files.DepthCamera()};
  NoteErrorOf(run.record, [&] { watch.End(); });
  ChooseAxes(arguments.written, {}, run.place, result.reconstruction);
  progress_line.reset();
  if (result.reconstruction.self_calibration) TellOfCamera(run, prior, result);
  Write(run, result, pipeline.tracker());
  return result;
}

Result MakeRun(const Run& run) {
  return LearnsCameraLive(run.arguments) ? RunWhileLearningCamera(run) : RunWithKnownCamera(run);
}

// A run whose page cannot be written is none the worse.
void WriteReport(const Run& run, const Reconstruction& reconstruction,
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

int ReconstructInto(OutputFolder& output, Arguments& arguments,
                    const std::shared_ptr<Device>& device, const CameraModel& prior_camera,
                    std::optional<GroundControl> control, RunRecord& record) {
  const double start_ms = WallClockMs();
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
  StageTimes times;
  FramesSoFar frames;
  WriteFailures failures;
  RunNotes notes;
  EarlierParts earlier;
  arguments.view.Open();
  const Run run{arguments,
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
                 FindPositions(arguments.input, arguments.positions),
                 arguments.positions.georeference, std::move(control)},
                journal ? &*journal : nullptr,
                earlier,
                start_ms};
  const Result result = MakeRun(run);
  failures.NoteIn(record);
  if (arguments.live) record.live_input = arguments.live->Report();
  record.stages = times.Snapshot();
  record.wall_s = earlier.wall_s + 1e-3 * (WallClockMs() - start_ms);
  record.cpu_s = earlier.cpu_s + 1e-3 * ProcessCpuMs();
  NoteErrorOf(record, [&] { writer.WriteRecord(result.reconstruction, record); });
  const std::string why_no_model = WhyNoModel(result.reconstruction);
  WriteReport(run, result.reconstruction, why_no_model, output.of_run());
  const bool is_whole = record.end == RunEnd::kFinished && why_no_model.empty();
  if (journal && record.end == RunEnd::kFinished) journal->Remove();
  if (is_whole) output.TakePlaceOfEarlier();
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
  if (!why_no_model.empty()) throw Error(why_no_model);
  if (const std::string kept = output.Keep(); !kept.empty()) std::printf("%s\n", kept.c_str());
  return WriteRunProducts(is_whole ? arguments.products : "", output.of_run());
}

// Says on stdout which device it is, where there are others.
void TellOfDevice(const DeviceInfo& device) {
  const std::size_t num_devices = ListDevices().size();
  if (num_devices < 2) return;
  std::printf("device %d of %zu: %s (another one: --device, see --list-devices)\n", device.index,
              num_devices, device.name.c_str());
}

// What a camera that sends now means for the other arguments.
void PrepareForLive(Arguments& arguments) {
  if (!IsLiveInput(arguments.input)) return;
  arguments.pipeline.is_live = true;
  // There is nothing beside it, and nothing to go back to.
  if (arguments.positions.source == "auto") arguments.positions.source = "none";
  arguments.written.images = ImagePlacing::kNone;
}

// Live, no image is waited for and none is dear: the tracker takes what it has time for.
void TakeEveryImageLive(FrameSourceOptions& source) {
  if (source.stride != kStrideByMotion) return;
  std::printf("--stride auto is for recordings that are not played live: every image is taken\n");
  source.stride = 1;
}

int Reconstruct(Arguments& arguments, const DeviceOptions& device_options) {
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
  if (!arguments.live) RequireOtherFolder(arguments.input, arguments.output);
  if (!arguments.save_map.empty()) RequireWritableFile(arguments.save_map);
  DeviceOptions own_device_options = device_options;
  own_device_options.yields = arguments.pipeline.is_live;
  const std::shared_ptr<Device> device = OpenDevice(own_device_options);
  TellOfDevice(Info(*device));
  RunRecord record;
  record.input = WithoutPassword(arguments.input);
  record.camera = arguments.camera.file;
  record.device = Info(*device);
  record.options = ListAll(arguments);
  if (arguments.source.stride == kStrideByMotion) record.num_passed_over_images = 0;
  OutputFolder output(arguments.output, arguments.resumes);
  return KeepingOnFailure(output, [&] {
    return ReconstructInto(output, arguments, device, camera, std::move(control), record);
  });
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-reconstruct",
            "Makes a coloured 3D model from a video or photographs of one camera.");
  Arguments arguments;
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
  tool.app().add_flag("--photos,!--video", arguments.photos,
                      "the images are photographs in any order, or a video; else it is found out");
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
  tool.AddOptions(mono3d::ListOptions(arguments.mesh), "mesh.");
  tool.AddOptions(mono3d::ListOptions(arguments.camera.calibration), "calibration.");
  tool.AddOptions(mono3d::ListOptions(arguments.pipeline));
  tool.AddOptions(mono3d::ListOptions(arguments.self_calibration), "live.calibration.");
  tool.AddOptions(mono3d::ListOptions(arguments.live_input), "live.input.");
  tool.AddOptions(mono3d::ListOptions(arguments.positions.georeference), "positions.");
  tool.AddOptions(mono3d::ListOptions(arguments.control.options), "control.");
  return tool.Run(argc, argv, [&] { return Reconstruct(arguments, tool.common().device); });
}
