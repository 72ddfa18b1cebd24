// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/learned_camera_run.h"

#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "common/summary.h"
#include "common/tool.h"

namespace mono3d::tools {
namespace {

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
void TellOfCamera(const ReconstructRun& run, const CameraPrior& prior, ReconstructResult& result) {
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

}  // namespace

bool LearnsCameraLive(const ReconstructArguments& arguments) {
  const bool is_held = arguments.camera.is_held && !arguments.camera.file.empty();
  return arguments.pipeline.is_live && !is_held;
}

ReconstructResult RunWhileLearningCamera(const ReconstructRun& run) {
  const ReconstructArguments& arguments = run.arguments;
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
  AdoptedFiles files(run.writer, run.failures, run.times);
  SelfCalibrationSetup setup;
  setup.prior = prior.Resized(source->camera().width, source->camera().height);
  setup.create_stages = [&] { return CreateStages(arguments.pipeline, run.device, &run.times); };
  setup.create_observer = [&](const CameraModel&) {
    return ObserverOf(run, *progress_line, files.BeginRun());
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
  PlaceOfRun place = run.place;
  options.positions = PositionsFor(place);
  SelfCalibratingPipeline pipeline(std::move(setup), options, arguments.self_calibration);
  RunView::Watch watch(run.view, pipeline, NumFrames(*source, arguments));
  {
    InterimWriter interim(run.writer, run.frames, run.record, [&] { return pipeline.Snapshot(); });
    PositionWatch new_positions(
        options.positions ? PositionsToWatch(arguments.positions, true) : std::nullopt,
        [&pipeline](const PositionTrack& track) { pipeline.GivePositions(track); });
    PushFrames(std::move(source), PaceOf(arguments), pipeline, run.record);
    if (std::optional<PositionTrack> all = new_positions.End()) {
      pipeline.GivePositions(*all);
      place.positions = std::move(all);
    }
    NoteErrorOf(run.record, [&] { interim.End(); });
  }
  ReconstructResult result{FinishAfterAll(pipeline, run.record), {{prior.camera}}, {}};
  files.Wait();
  result.depth_camera = files.DepthCamera();
  NoteErrorOf(run.record, [&] { watch.End(); });
  ChooseAxes(arguments.written, {}, place, result.reconstruction);
  progress_line.reset();
  if (result.reconstruction.self_calibration) TellOfCamera(run, prior, result);
  WriteResult(run, result, pipeline.tracker());
  return result;
}

}  // namespace mono3d::tools
