// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "mono3d/core/state_folder.h"
#include "mono3d/pipeline/run_writer.h"

namespace mono3d::tools {

// The folder of the journal, in that of its run.
inline constexpr const char* kJournalFolder = "journal";

// The state of a run, saved every few seconds while it goes on, in journal/ of its folder: a run
// that was killed goes on from there (--resume).
class RunJournal {
 public:
  // Opens what is there. `record`: of the start, by whose input, camera and options runs are told
  // apart. Throws Error where the journal is damaged.
  RunJournal(const std::filesystem::path& run_folder, const RunRecord& record);
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;
  ~RunJournal();  // waits

  // There is a state to go on from.
  bool HasState() const { return !states_.empty(); }
  // The frame up to which it is.
  std::int64_t last_frame() const { return last_frame_; }
  const StateFolder& states() const { return states_; }
  // What `own` was at that time; throws UsageError where the state is of another run: input,
  // options or version.
  nlohmann::json ReadState();

  // What is saved: puts the state of the pipeline into the save, and returns that of the tool.
  using PutState = std::function<nlohmann::json(StateFolder& states)>;
  // After each frame. Saves when that is due, and leaves the waiting for the disk to a thread; what
  // cannot be saved is warned of once, and the run goes on.
  void SaveIfDue(std::int64_t frame_index, double timestamp_s, const PutState& put);
  // Saves now, if that frame is newer than the latest save, and waits until it is on the disk.
  void Save(std::int64_t frame_index, const PutState& put);
  // Until the save that is being made, if there is one, is on the disk.
  void Wait();
  // The run is whole, nobody will go on with it. Throws Error (kIo).
  void Remove();

 private:
  void Begin(std::int64_t frame_index, const PutState& put);
  void Warn(const std::exception& error);

  std::filesystem::path folder_;
  nlohmann::json identity_;
  StateFolder states_;
  std::int64_t last_frame_ = -1;           // of what is on the disk
  std::future<StateSaveCost> on_its_way_;  // to the disk: nobody else may use states_
  std::int64_t frame_on_its_way_ = -1;
  std::optional<double> saved_video_s_;  // time stamp of the frame of the latest save
  double ended_wall_s_;                  // when the run went on after that
  double duration_s_ = 0;                // that the run stood still for it
  bool has_warned_ = false;
};

// The folder below `output` with the newest journal: a run that took the place of none yet lies in
// unfinished_N. Nothing where there is none.
std::optional<std::filesystem::path> FolderToResume(const std::filesystem::path& output);

}  // namespace mono3d::tools
