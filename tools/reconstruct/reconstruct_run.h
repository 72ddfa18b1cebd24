// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>

#include "common/progress.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/adopted_files.h"
#include "reconstruct/interim_results.h"
#include "reconstruct/live_run.h"
#include "reconstruct/positions.h"
#include "reconstruct/processing.h"
#include "reconstruct/reconstruct_arguments.h"
#include "reconstruct/resuming.h"
#include "reconstruct/run_journal.h"
#include "reconstruct/write_failures.h"

namespace mono3d::tools {

// What all runs of the tool have.
struct ReconstructRun {
  const ReconstructArguments& arguments;
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

struct ReconstructResult {
  Reconstruction reconstruction;
  CamerasOfImages cameras;  // of the images as they are read, before --resize
  std::optional<CameraModel> depth_camera = {};
};

std::unique_ptr<FrameSource> OpenFrames(const ReconstructArguments& arguments,
                                        const FrameSourceOptions& source,
                                        const CamerasOfImages& cameras);

// How many frames will come, where that is known.
std::optional<std::int64_t> NumFrames(const FrameSource& source,
                                      const ReconstructArguments& arguments);

Pace PaceOf(const ReconstructArguments& arguments);

// `run`, `progress_line` and `images` must outlive it.
// `images`: null where the keyframes' images are not written yet.
PipelineObserver ObserverOf(const ReconstructRun& run, ProgressLine& progress_line,
                            const std::shared_ptr<AdoptedFiles::Run>& files,
                            KeyframeImageWriter* images = nullptr);

// In the order of their worth; what cannot be written is noted, and the rest goes on.
void WriteResult(const ReconstructRun& run, ReconstructResult& result, const Tracker& tracker,
                 const std::set<std::int64_t>& written_images = {});

}  // namespace mono3d::tools
