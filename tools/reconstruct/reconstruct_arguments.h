// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_choice.h"
#include "common/scene_mask.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/triangle_mesh.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/live_input.h"
#include "mono3d/pipeline/footage.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/self_calibrating_pipeline.h"
#include "reconstruct/ground_control.h"
#include "reconstruct/output_options.h"
#include "reconstruct/positions.h"
#include "reconstruct/run_view.h"
#include "reconstruct/working_size.h"

namespace mono3d::tools {

// What the command line of mono3d-reconstruct says.
struct ReconstructArguments {
  std::string command;  // as it was given
  std::string input;
  CameraArguments camera;
  std::string output;
  std::string map;                 // to go on in; empty: none
  std::string save_map;            // empty: not saved
  int photos = 0;                  // 1: photographs in any order; -1: a video; 0: to be found out
  std::optional<Footage> footage;  // where that has been found out
  FrameSourceOptions source;
  MaskArguments mask;
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

// All options of the run, for its record.
std::vector<OptionField> ListAll(ReconstructArguments& arguments);

// A saved map has the camera of its run.
void RequireSameCamera(ReconstructArguments& arguments);

// What --live, or a camera that sends now, means for the other arguments.
void PrepareForLive(ReconstructArguments& arguments);

// Live, no image is waited for and none is dear: the tracker takes what it has time for.
void TakeEveryImageLive(FrameSourceOptions& source);

}  // namespace mono3d::tools
