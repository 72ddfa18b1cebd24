// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"
#include "reconstruct/reconstruct_arguments.h"

namespace mono3d::tools {

// What came of a run whose files are written.
struct RunOutcome {
  bool is_whole = false;  // it came to its end, with a model
  std::string why_no_model;
  bool was_tracked = false;     // from one image to the next
  bool was_track_lost = false;  // on the way
  std::int64_t num_images = 0;
  bool is_broken = false;          // the model, by its health
  std::size_t num_in_model = 0;    // images with a pose in the map of the model
  std::int64_t num_posed = 0;      // images with a pose in any map
  double images_per_keyframe = 0;  // of those that were followed; 0: there is no keyframe
  double wall_s = 0;
  // Positions of the images of each map in the input, in the order of time.
  std::vector<std::vector<std::int64_t>> images_of_maps = {};

  // More of its images are in the model, and that is not broken where the other one is not.
  bool IsBetterThan(const RunOutcome& other) const {
    const bool is_worse = is_broken && other.is_whole && !other.is_broken;
    return is_whole && !is_worse &&
           static_cast<double>(num_in_model) * static_cast<double>(other.num_images) >
               static_cast<double>(other.num_in_model) * static_cast<double>(num_images);
  }
};

RunOutcome OutcomeOf(const Reconstruction& reconstruction, const RunRecord& record,
                     const std::string& why_no_model);

// Images of a recording that could not be followed from one to the next, so that more than a tenth
// of them is not in the model: matched with those that look most alike, whenever they were taken,
// they may still make one. Not where they are too many for that, --video says that they are to be
// followed, or the run goes on in an earlier map; nor where all were followed, and are in several
// maps because the camera turned on the spot: nobody would say that their common scale is a guess.
bool MayBePlacedTogether(const ReconstructArguments& arguments, const RunOutcome& tracked);

// Whether nothing is gained by it: nearly all images have a pose, and of the maps that they are in
// no two show the same, as where a film is cut from one place to another. A few images of each map
// are matched with those of the others, its first and its last among them.
bool ShowOtherPlaces(const ReconstructArguments& arguments, const RunOutcome& tracked);

// What is said of them.
std::string OtherPlacesLine(const RunOutcome& tracked);

// Which images are placed: every one, or, of the images of a video that show next to nothing new,
// every so many. Neighbours in time look most alike, and images that are matched with such alone
// leave no map: there are two for each keyframe that following them has made.
int StrideOfPlacing(const ReconstructArguments& arguments, const RunOutcome& tracked);

// What is done then, and why.
std::string PlacedTogetherLine(const RunOutcome& tracked, int stride);

}  // namespace mono3d::tools
