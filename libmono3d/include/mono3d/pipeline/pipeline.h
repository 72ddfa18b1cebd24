// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/state_folder.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/frame_images.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/pipeline/snapshot.h"
#include "mono3d/pipeline/stages.h"

namespace MONO3D_EXPORT mono3d {

struct PipelineProgress {
  const PipelineCounts& counts;
  const TrackingResult& tracking;                // of the latest frame
  std::int64_t num_surfels = 0;                  // in the current model
  const ModelHealth& health;                     // of the current model
  std::int64_t frame_index = 0;                  // of the latest frame
  std::shared_ptr<const PlaceOfMap> place = {};  // see PipelineSnapshot
};

// Called from within Process and Finish; what they throw comes out there. Where the models are made
// by threads of their own (PipelineOptions), on_depth_map is called by one of these, one call at a
// time; live, the others, after Start, by the one that tracks; what they throw comes out of a later
// call.
struct PipelineObserver {
  std::function<void(const PipelineProgress&)> on_frame;
  // Each keyframe that depth may be made of, its image that of a global shutter.
  std::function<void(const Keyframe&)> on_keyframe;
  std::function<void(const DepthMap&, const FusionResult&)> on_depth_map;
};

// What became of a pushed frame: it waits to be tracked, or is being tracked.
struct PushResult {
  std::vector<std::int64_t> dropped;  // indices of earlier frames that were dropped instead
  std::int64_t num_waiting = 0;       // with this one
};

// The chain of the paper's Figure 1. Used in one of two ways:
//
//   In the order of the frames        At the pace of a camera (options.is_live)
//   Process, Process, ..., Finish     Start; Push, Push, ...; Stop
//   or Run
//
// Snapshot and GivePositions may be called at any time by any thread, Push by any thread, in the
// order of time. All other calls come from one thread at a time.
class Pipeline {
 public:
  // Of the options, those of the stages have been given to CreateStages.
  explicit Pipeline(PipelineStages stages, PipelineObserver observer = {},
                    const PipelineOptions& options = {});
  // Ends after the work in hand. What waits is left undone.
  ~Pipeline();

  // Takes the next frame through tracking and the choice of keyframes, and the bundle that it may
  // complete through depth and fusion, in threads of their own or before Process returns
  // (PipelineOptions::models_trail). The caller may change its image afterwards: where the frame is
  // not the only one that holds it, it is copied. Throws Error after Start.
  void Process(Frame frame);

  // Between two calls of Process, and not after one that threw: puts all that the run has so far
  // into the save that is being made; Commit is the caller's. Images are named by the indices of
  // their frames. `at_rest` is called before the observer may be told of further depth maps: what
  // it has been told by then is what the state has. Throws UsageError for a live run and for
  // photographs, and what StateFolder::Put and `at_rest` throw, after which the run can go on.
  void SaveState(
      StateFolder& folder, const std::function<void()>& at_rest = [] {});
  // The frames whose images RestoreState will ask for.
  static std::vector<std::int64_t> FramesOfState(const StateFolder& folder);
  // Before the first Process, with stages and options like those of the run that was saved: goes on
  // with the frame after the last one that that had processed, and comes to the same result.
  // `images` are asked for those that are still needed. From then on the observer may be told of
  // depth maps. Throws Error on a state that is damaged or
  // was saved with other options; the pipeline is of no use then.
  void RestoreState(const StateFolder& folder, const ImageOfFrame& images);

  // Takes what is still on its way through the stages and hands over the result. Call once, last.
  // After a Process that threw, or a Finish, too: what there was before is not lost, and what is on
  // its way is left out where a stage after the tracker threw.
  [[nodiscard]] Reconstruction Finish();

  // Process for all frames of the source, until it ends or `*stop` becomes true; then Finish.
  [[nodiscard]] Reconstruction Run(FrameSource& source, const std::atomic<bool>* stop = nullptr);

  // Begins to track frames that are pushed, in a thread of its own. Throws Error on the second call
  // and after Process.
  void Start();

  // Hands a frame over and returns at once. While the tracker is busy frames wait, and old ones are
  // dropped as LiveOptions says. The caller may change the image afterwards: where the frame is not
  // the only one that holds it, it is copied. Throws Error before Start and after Stop; on a frame
  // that is invalid, of another camera than the first or not after the one before, which is then
  // left out; and what one of the threads has thrown, after which no more frames are tracked.
  PushResult Push(Frame frame);

  // All positions that there are so far, in place of those of PipelineOptions::positions: the drone
  // writes while it flies. Used with one of the next keyframes. From any thread, before Finish or
  // Stop. Throws UsageError where the options have no positions.
  void GivePositions(PositionTrack track);

  // What there is by now. Nothing waits for it, and it waits for nothing but to copy values. Each
  // call asks for surfels: for half a minute they are published, in the thread that makes the
  // models, as often as that takes no more than a tenth of its time. Throws what one of the threads
  // has thrown, unless an earlier call has.
  [[nodiscard]] PipelineSnapshot Snapshot(std::uint64_t since_version = 0) const;

  // The same without surfels, and without asking for any.
  [[nodiscard]] PipelineSnapshot State() const;

  // No more frames: tracks those that wait, and then as Finish. Throws what one of the threads has
  // thrown, unless an earlier call has; another call returns what there was before. Without Start
  // there was no frame.
  [[nodiscard]] Reconstruction Stop();

  // Until Start, or after Finish or Stop.
  const Tracker& tracker() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d
