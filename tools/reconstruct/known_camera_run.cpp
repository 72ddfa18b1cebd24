// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/known_camera_run.h"

#include <cstdio>
#include <future>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "common/photo_cameras.h"
#include "common/summary.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/io/camera_metadata.h"
#include "mono3d/pipeline/georeferencing.h"
#include "mono3d/pipeline/images_of_run.h"
#include "mono3d/pipeline/map_file.h"
#include "reconstruct/footage.h"
#include "reconstruct/position_watch.h"

namespace mono3d::tools {
namespace {

// Says on stdout what was found out.
Footage FindFootage(const ReconstructArguments& arguments, StageTimes& times) {
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
  if (arguments.footage) return *arguments.footage;
  const ScopedStageTimer timer(&times, "footage");
  return FootageOf(arguments.input, arguments.camera, arguments.source);
}

// Says on stdout what the photographs say of their cameras.
CamerasOfImages FindCameras(const ReconstructArguments& arguments, const FrameSourceOptions& source,
                            const PhotoMapperOptions& photos,
                            const std::vector<CameraGroup>& groups, const PositionsOfMap& positions,
                            const RunWriter& writer, StageTimes& times, RunRecord& record) {
  if (arguments.with_global_shutter_images) {
    throw UsageError("photographs of several cameras have no --global-shutter-images");
  }
  const ScopedStageTimer timer(&times, "calibration");
  PhotoCameras found =
      ChooseCamerasOfPhotos(arguments.input, groups, source, arguments.camera, photos, positions);
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
CamerasOfImages FindCamera(const ReconstructArguments& arguments, const FrameSourceOptions& source,
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
    if (groups.size() > 1) {
      return FindCameras(arguments, source, *photos, groups, positions, writer, times, record);
    }
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

// Of a video that is not played live: else images are dropped before the tracker has seen them.
bool MayWriteImagesEarly(const ReconstructRun& run, Footage footage) {
  const ReconstructArguments& arguments = run.arguments;
  std::error_code ignored;
  return footage == Footage::kVideo && !arguments.pipeline.is_live &&
         !arguments.with_global_shutter_images && arguments.written.images != ImagePlacing::kNone &&
         std::filesystem::is_regular_file(arguments.input, ignored) &&
         MayPlaceImages(std::filesystem::path(arguments.output) / kImagesOfRun);
}

}  // namespace

ReconstructResult RunWithKnownCamera(const ReconstructRun& run) {
  const ReconstructArguments& arguments = run.arguments;
  ReconstructResult result;
  PipelineOptions options = arguments.pipeline;
  // Its kernels are made while the images are looked at.
  std::future<std::unique_ptr<DepthEstimator>> depth_estimator =
      std::async(std::launch::async, [&run, depth = options.depth] {
        return CreateDepthEstimator(run.device, depth, &run.times);
      });
  const Footage footage = FindFootage(arguments, run.times);
  FrameSourceOptions images_taken =
      arguments.size.Limit(arguments.source, footage, run.prior_camera);
  run.record.are_photos = footage == Footage::kPhotographs;
  run.record.is_sparse_video = footage == Footage::kSparseVideo;
  options.are_photos = footage != Footage::kVideo;
  options.photos.are_frames = footage == Footage::kSparseVideo;
  options.photos.stop = &StopRequested();
  {
    ProgressLine of_camera;
    options.photos.on_progress = [&](const PhotoMapperProgress& progress) {
      of_camera.Show(progress, "learning the camera");
    };
    result.cameras =
        FindCamera(arguments, images_taken, options.are_photos ? &options.photos : nullptr,
                   run.place, run.writer, run.times, run.record);
  }
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
  options.depth.hidden = source->hidden();
  CatchStopSignals();
  ProgressLine progress_line(NumFrames(*source, arguments));
  options.photos.on_progress = [&](const PhotoMapperProgress& progress) {
    progress_line.Show(progress);
  };
  AdoptedFiles files(run.writer, run.failures, run.times);
  PipelineStages stages = CreateStages(options, run.device, depth_estimator.get(), &run.times);
  std::optional<WorldAxes> saved_axes;
  if (!arguments.map.empty()) {
    // What the journal has of the tracker has the map.
    const std::unique_ptr<Tracker> of_map = resumes ? CreateTracker(options.tracking) : nullptr;
    saved_axes = LoadMapFile(of_map ? *of_map : *stages.tracker, arguments.map);
  }
  const std::shared_ptr<AdoptedFiles::Run> files_of_run = files.BeginRun();
  Pipeline pipeline(std::move(stages),
                    ObserverOf(run, progress_line, files_of_run, images ? &*images : nullptr),
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
    PositionWatch new_positions(
        options.positions ? PositionsToWatch(arguments.positions, options.is_live) : std::nullopt,
        [&pipeline](const PositionTrack& track) { pipeline.GivePositions(track); });
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
    if (std::optional<PositionTrack> all = new_positions.End()) {
      pipeline.GivePositions(*all);
      place.positions = std::move(all);
    }
    NoteErrorOf(run.record, [&] { interim.End(); });
  }
  result.reconstruction = FinishAfterAll(pipeline, run.record);
  if (options.are_photos && StopRequested() && run.record.end == RunEnd::kFinished) {
    run.record.end = RunEnd::kStopped;
  }
  NoteErrorOf(run.record, [&] { watch.End(); });
  files.Wait();
  result.depth_camera = files.DepthCamera();
  ChooseAxes(arguments.written, saved_axes, place, result.reconstruction);
  WriteResult(run, result, pipeline.tracker(),
              images ? images->written() : std::set<std::int64_t>());
  return result;
}

}  // namespace mono3d::tools
