// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/reconstruct_arguments.h"

namespace mono3d::tools {

// What came of a run whose files are written.
struct RunOutcome {
  bool is_whole = false;  // it came to its end, with a model
  std::string why_no_model;
  bool was_tracked = false;  // from one image to the next
  std::int64_t num_images = 0;
  std::size_t num_in_model = 0;  // images with a pose in the map of the model
  double wall_s = 0;

  bool IsBetterThan(const RunOutcome& other) const {
    return is_whole && num_in_model > other.num_in_model;
  }
};

RunOutcome OutcomeOf(const Reconstruction& reconstruction, const RunRecord& record,
                     const std::string& why_no_model);

// Images of a recording that could not be followed from one to the next, so that more than a tenth
// of them is not in the model: matched with those that look most alike, whenever they were taken,
// they may still make one. Not where they are too many for that, --video says that they are to be
// followed, or the run goes on in an earlier map.
bool MayBePlacedTogether(const ReconstructArguments& arguments, const RunOutcome& tracked);

// What is done then, and why.
std::string PlacedTogetherLine(const RunOutcome& tracked);

}  // namespace mono3d::tools
