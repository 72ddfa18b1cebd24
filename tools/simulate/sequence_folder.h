// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>

#include "simulate/sequence_record.h"
#include "synthetic/sequence.h"

namespace mono3d::tools {

// Called after each image; false ends the run in order.
using FrameObserver = std::function<bool(int num_done, int num_frames)>;

struct SequenceRun {
  SequenceRecord record;  // complete, unless the observer ended the run
  int num_rendered = 0;   // images; the others were there already
};

// Writes the folder of a sequence: images/, camera.yaml, timestamps.txt, groundtruth.txt, depth/,
// cloud.ply, gps.txt, gcp.txt, exposures.txt and sequence.json; on request video.mp4 and
// uncalibrated/. Files that are there from an earlier run with the same options stay, and the
// outcome is the same to the byte. Throws Error when the folder holds another sequence or cannot be
// written.
SequenceRun WriteSequence(const synthetic::SequenceOptions& options,
                          const SequenceFileOptions& file_options,
                          const std::filesystem::path& folder, const FrameObserver& observer);

}  // namespace mono3d::tools
