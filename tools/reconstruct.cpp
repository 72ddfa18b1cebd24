// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-reconstruct: from an image folder, a glob or a video to a coloured surfel model.

#include <utility>

#include "common/progress.h"
#include "common/summary.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/map_file.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/processing.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string input;
  std::string camera;
  std::string output;
  std::string map;       // to go on in; empty: none
  std::string save_map;  // empty: not saved
  FrameSourceOptions source;
  PipelineOptions pipeline;
  bool with_mesh = false;
  MeshOptions mesh;
};

std::vector<OptionField> ListAll(Arguments& arguments) {
  OptionVisitor visitor;
  arguments.source.Visit(visitor);
  arguments.pipeline.Visit(visitor);
  return visitor.fields();
}

int Reconstruct(Arguments& arguments, const DeviceOptions& device_options) {
  const double start_ms = WallClockMs();
  arguments.pipeline.Validate();
  arguments.mesh.Validate();
  const CameraModel calibration = ReadCameraFile(arguments.camera);
  std::unique_ptr<FrameSource> source =
      OpenFrameSource(arguments.input, calibration, arguments.source);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  const RunWriter writer(arguments.output);
  CatchStopSignals();

  StageTimes times;
  Reconstruction result;
  RunRecord record;
  record.input = arguments.input;
  record.camera = arguments.camera;
  record.device = Info(*device);
  {
    ProgressLine progress_line(source->num_frames());
    PipelineObserver observer;
    observer.on_frame = [&](const PipelineProgress& progress) { progress_line.Show(progress); };
    observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
      const ScopedStageTimer timer(&times, "io/write_depth_map");
      writer.WriteDepthMap(map);
    };
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
  writer.WriteSparseModels(result, calibration);
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
            "Makes a coloured 3D model from the video of one calibrated camera.\n"
            "Example: mono3d-reconstruct flight/ --camera camera.yaml -o model/");
  Arguments arguments;
  tool.app()
      .add_option("INPUT", arguments.input,
                  "image folder, quoted glob (\"flight/*.jpg\") or video file")
      ->required();
  tool.app()
      .add_option("--camera", arguments.camera,
                  "calibration: OpenCV or ROS camera.yaml, or COLMAP cameras.txt")
      ->required();
  tool.app()
      .add_option("-o,--output", arguments.output,
                  "folder for model.ply, trajectory.txt, depth/, sparse/ and run.json")
      ->required();
  tool.app().add_flag("--mesh", arguments.with_mesh,
                      "write mesh.ply as well: triangles through the surfels");
  tool.app().add_option("--map", arguments.map,
                        "map of an earlier run of the same camera, to go on in");
  tool.app().add_option("--save-map", arguments.save_map,
                        "file for the map, so that a later run can go on in it");
  tool.app().add_flag("--live", arguments.pipeline.is_live,
                      "images come at the pace of their time stamps, as from a camera; nothing "
                      "waits for depth, what there is no time for is dropped and counted");
  tool.AddOptions(mono3d::ListOptions(arguments.source));
  tool.AddOptions(mono3d::ListOptions(arguments.mesh), "mesh.");
  tool.AddOptions(mono3d::ListOptions(arguments.pipeline));
  return tool.Run(argc, argv, [&] { return Reconstruct(arguments, tool.common().device); });
}
