// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/reconstruct_run.h"

#include <cstdio>
#include <string>
#include <system_error>

#include "common/tool.h"
#include "mono3d/pipeline/images_of_run.h"
#include "mono3d/pipeline/map_file.h"

namespace mono3d::tools {
namespace {

// The map of a run that came to its end takes the place of an earlier one, that of another does
// not.
void SaveMapOfRun(const ReconstructRun& run, const Reconstruction& result, const Tracker& tracker) {
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

void NoteCamerasOfFiles(const ReconstructRun& run, const ReconstructResult& result) {
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

// `written`: frames whose images are there already.
void PlaceImages(const ReconstructRun& run, const std::set<std::int64_t>& written,
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

}  // namespace

std::unique_ptr<FrameSource> OpenFrames(const ReconstructArguments& arguments,
                                        const FrameSourceOptions& source,
                                        const CamerasOfImages& cameras) {
  if (!arguments.live) return OpenFrameSource(arguments.input, cameras, source);
  return arguments.live->Frames(cameras.cameras.front(), source, &StopRequested());
}

std::optional<std::int64_t> NumFrames(const FrameSource& source,
                                      const ReconstructArguments& arguments) {
  if (arguments.source.stride == kStrideByMotion) return std::nullopt;
  return source.num_frames();
}

Pace PaceOf(const ReconstructArguments& arguments) {
  return arguments.live ? Pace::kAsTheyCome : Pace::kByTimeStamps;
}

PipelineObserver ObserverOf(const ReconstructRun& run, ProgressLine& progress_line,
                            const std::shared_ptr<AdoptedFiles::Run>& files,
                            KeyframeImageWriter* images) {
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
    files->WriteDepthMap(map);
    run.notes.AddDepthMap(map);
  };
  observer.on_keyframe = [&run, files](const Keyframe& keyframe) {
    run.frames.Take(keyframe);
    if (run.arguments.with_global_shutter_images) files->WriteKeyframeImage(keyframe.frame);
  };
  run.view.AddTo(observer);
  return observer;
}

void WriteResult(const ReconstructRun& run, ReconstructResult& result, const Tracker& tracker,
                 const std::set<std::int64_t>& written_images) {
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
  NoteErrorOf(run.record, [&] { SaveMapOfRun(run, reconstruction, tracker); });
  if (!run.arguments.with_mesh) return;
  const ScopedStageTimer timer(&run.times, "io/write_mesh");
  NoteErrorOf(run.record, [&] { run.writer.WriteMeshes(reconstruction, run.arguments.mesh); });
}

}  // namespace mono3d::tools
