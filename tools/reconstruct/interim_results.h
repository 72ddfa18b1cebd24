// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "mono3d/pipeline/snapshot.h"

namespace mono3d::tools {

// The frames and keyframes that a run has so far. Any thread.
class FramesSoFar {
 public:
  void Take(const PipelineProgress& progress);
  void Take(const Keyframe& keyframe);
  // The keyframes are those of another tracker from now on.
  void Forget();

  double latest_s() const;  // time stamp of the latest frame
  // Of the map that the snapshot's model is of; without one, of the map with most frames.
  MapReconstruction InMap(const PipelineSnapshot& snapshot) const;

  // For the journal of a run, and back; see common/state_json.h.
  nlohmann::json ToJson() const;
  void TakeJson(const nlohmann::json& json);

 private:
  void Keep(const FramePose& frame) { frames_[frame.frame_index] = frame; }

  mutable std::mutex mutex_;
  double latest_s_ = 0;
  std::map<std::int64_t, FramePose> frames_;        // by frame
  std::map<std::int64_t, TrajectoryEntry> stamps_;  // of keyframes, by id; without a pose
};

// Writes trajectory.txt, keyframes.txt, model.ply and run.json as they are so far, in a thread of
// its own, every few seconds of the video: what a run has that is killed. All in metres as soon as
// the positions of the run tell them. Beside a journal, from
// which the model can be made, only a small model: the copy that is written takes 90 bytes of
// memory for each surfel, and would grow with the flight.
class InterimWriter {
 public:
  using TakeSnapshot = std::function<PipelineSnapshot()>;
  // What is read must outlive it; `snapshot` is called in its thread. `record`: of the start.
  // `state`: that without surfels; given where there is a journal.
  InterimWriter(const RunWriter& writer, const FramesSoFar& frames, RunRecord record,
                TakeSnapshot snapshot, TakeSnapshot state = {});
  ~InterimWriter();
  InterimWriter(const InterimWriter&) = delete;
  InterimWriter& operator=(const InterimWriter&) = delete;

  // Nothing is written any more. Throws what a snapshot has thrown: the run has failed.
  void End();

 private:
  void Run();
  void Write();

  const RunWriter& writer_;
  const FramesSoFar& frames_;
  RunRecord record_;
  TakeSnapshot snapshot_;
  TakeSnapshot state_;  // may be empty
  // That were written.
  std::uint64_t model_version_ = 0;
  std::shared_ptr<const PlaceOfMap> place_;
  bool has_warned_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_ending_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace mono3d::tools
