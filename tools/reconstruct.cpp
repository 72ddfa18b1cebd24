// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-reconstruct: from an image folder, a glob or a video to a coloured surfel model.

#include <cstdio>
#include <utility>

#include "common/camera_choice.h"
#include "common/progress.h"
#include "common/summary.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/map_file.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/processing.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string input;
  CameraArguments camera;
  std::string output;
  std::string map;       // to go on in; empty: none
  std::string save_map;  // empty: not saved
  FrameSourceOptions source;
  PipelineOptions pipeline;
  bool with_global_shutter_images = false;
  bool with_mesh = false;
  MeshOptions mesh;
};

std::vector<OptionField> ListAll(Arguments& arguments) {
  OptionVisitor visitor;
  arguments.source.Visit(visitor);
  visitor.Group("calibration", arguments.camera.calibration);
  arguments.pipeline.Visit(visitor);
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

// Says on stdout what the images say of their camera.
CameraModel FindCamera(const Arguments& arguments, const RunWriter& writer, StageTimes& times,
                       RunRecord& record) {
  const ScopedStageTimer timer(&times, "calibration");
  CameraChoice choice = ChooseCamera(arguments.input, arguments.source, arguments.camera);
  if (choice.calibration) {
    const std::string line = CameraLine(*choice.calibration);
    if (!line.empty()) std::printf("%s\n", line.c_str());
    if (choice.calibration->is_learned) writer.WriteCamera(choice.camera);
    record.calibration = std::move(choice.calibration);
  }
  return choice.camera;
}

int Reconstruct(Arguments& arguments, const DeviceOptions& device_options) {
  const double start_ms = WallClockMs();
  arguments.pipeline.Validate();
  arguments.mesh.Validate();
  arguments.camera.calibration.Validate();
  RequireSameCamera(arguments);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  const RunWriter writer(arguments.output);

  StageTimes times;
  Reconstruction result;
  RunRecord record;
  record.input = arguments.input;
  record.camera = arguments.camera.file;
  record.device = Info(*device);
  const CameraModel camera = FindCamera(arguments, writer, times, record);
  std::unique_ptr<FrameSource> source = OpenFrameSource(arguments.input, camera, arguments.source);
  CatchStopSignals();
  {
    ProgressLine progress_line(source->num_frames());
    PipelineObserver observer;
    observer.on_frame = [&](const PipelineProgress& progress) { progress_line.Show(progress); };
    observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
      const ScopedStageTimer timer(&times, "io/write_depth_map");
      writer.WriteDepthMap(map);
    };
    if (arguments.with_global_shutter_images) {
      observer.on_keyframe = [&](const Keyframe& keyframe) {
        const ScopedStageTimer timer(&times, "io/write_global_shutter_image");
        writer.WriteKeyframeImage(keyframe.frame);
      };
    }
    PipelineStages stages = CreateStages(arguments.pipeline, device, &times);
    if (!arguments.map.empty()) LoadMapFile(*stages.tracker, arguments.map);
    Pipeline pipeline(std::move(stages), observer, arguments.pipeline);
    if (arguments.pipeline.is_live) {
      PushFrames(std::move(source), pipeline, record);
    } else {
      ProcessFrames(*source, pipeline, times, record);
    }
    result = FinishAfterAll(pipeline, record);
    if (!arguments.save_map.empty() && !result.maps.empty()) {
      SaveMapFile(pipeline.tracker(), arguments.save_map);
    }
  }
  writer.WriteReconstruction(result);
  if (arguments.with_mesh) {
    const ScopedStageTimer timer(&times, "io/write_mesh");
    NoteErrorOf(record, [&] { writer.WriteMeshes(result, arguments.mesh); });
  }
  if (arguments.with_global_shutter_images) {
    writer.WriteSparseModelsOfKeyframeImages(result);
  } else {
    writer.WriteSparseModels(result, camera);
  }
  record.options = ListAll(arguments);
  record.stages = times.Snapshot();
  record.wall_s = 1e-3 * (WallClockMs() - start_ms);
  record.cpu_s = 1e-3 * ProcessCpuMs();
  writer.WriteRecord(result, record);
  PrintSummary(result, record, writer.model_path());
  if (record.end == RunEnd::kFailed) throw Error(record.error);
  if (const std::string reason = WhyNoModel(result); !reason.empty()) throw Error(reason);
  return 0;
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-reconstruct",
            "Makes a coloured 3D model from the video of one camera.\n"
            "Example: mono3d-reconstruct flight/ -o model/");
  Arguments arguments;
  tool.app()
      .add_option("INPUT", arguments.input,
                  "image folder, quoted glob (\"flight/*.jpg\") or video file")
      ->required();
  tool.app().add_option(
      "--camera", arguments.camera.file,
      "calibration: OpenCV or ROS camera.yaml, or COLMAP cameras.txt; without it the "
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
  tool.app().add_flag("--global-shutter-images", arguments.with_global_shutter_images,
                      "write images_global_shutter/ as well: the keyframes' images without "
                      "distortion and as of a global shutter; sparse/ is then of them");
  tool.app().add_option("--map", arguments.map,
                        "map of an earlier run of the same camera, to go on in");
  tool.app().add_option("--save-map", arguments.save_map,
                        "file for the map, so that a later run can go on in it");
  tool.app().add_flag("--live", arguments.pipeline.is_live,
                      "images come at the pace of their time stamps, as from a camera; nothing "
                      "waits for depth, what there is no time for is dropped and counted");
  tool.AddOptions(mono3d::ListOptions(arguments.source));
  tool.AddOptions(mono3d::ListOptions(arguments.mesh), "mesh.");
  tool.AddOptions(mono3d::ListOptions(arguments.camera.calibration), "calibration.");
  tool.AddOptions(mono3d::ListOptions(arguments.pipeline));
  return tool.Run(argc, argv, [&] { return Reconstruct(arguments, tool.common().device); });
}
