// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "mono3d/core/timing.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/adopted_files.h"
#include "reconstruct/interim_results.h"
#include "reconstruct/run_journal.h"
#include "run_report/run_notes.h"

namespace mono3d::tools {

// Of the names and pixels of the frames that were read so far, in their order. For one program on
// one machine: nothing else compares it.
class InputDigest {
 public:
  void Add(const Frame& frame);
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

// Adds what is read to `digest`, which must outlive it.
std::unique_ptr<FrameSource> WithDigest(std::unique_ptr<FrameSource> source, InputDigest& digest);

// What a journal saves of a run: its pipeline, and what the tool itself has collected.
struct JournaledRun {
  Pipeline& pipeline;
  FramesSoFar& frames;
  RunNotes& notes;
  AdoptedFiles::Run& files;
  StageTimes& times;
  const InputDigest& input;
};

// The parts of a run that were made by processes before this one.
struct EarlierParts {
  double wall_s = 0;
  double cpu_s = 0;
  std::vector<std::int64_t> last_frames;  // of each: it was resumed behind that
};

// For RunJournal::Save; `wall_s`: of this process.
nlohmann::json PutRun(const JournaledRun& run, const EarlierParts& earlier, double wall_s,
                      StateFolder& states);

// Takes the run to where the journal has it: reads `source`, whose digest is `run.input`, up to its
// last frame. Throws
// UsageError where the journal is of another run, Error where it is damaged or the input is no
// longer the same.
EarlierParts Resume(RunJournal& journal, FrameSource& source, const JournaledRun& run);

}  // namespace mono3d::tools
