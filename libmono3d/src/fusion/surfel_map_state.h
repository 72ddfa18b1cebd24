// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>

#include "fusion/change_log.h"
#include "fusion/depth_map_fuser.h"
#include "fusion/fusion_context.h"
#include "fusion/part_merger.h"
#include "fusion/registration/depth_map_placer.h"
#include "fusion/saved_surfels.h"
#include "fusion/vignetting.h"
#include "mono3d/core/state_folder.h"

namespace mono3d {

// The parts of a surfel map that outlast a call.
struct SurfelMapParts {
  FusionContext& context;
  SurfelModel& model;
  PartMerger& merger;
  DepthMapPlacer& placer;
  DepthMapFuser& fuser;
  ChangeLog& changes;
  Vignetting& vignetting;
  std::optional<int>& map_id;
};

// What of a surfel map is in a StateFolder: its surfels, the images that it looks back at, and the
// rest, which is small.
class SurfelMapState {
 public:
  void Save(const SurfelMapParts& parts, StateFolder& folder, const std::string& name);
  void Restore(const SurfelMapParts& parts, const StateFolder& folder, const std::string& name);

 private:
  SavedSurfels surfels_;
  SavedSurfels inferred_;
};

}  // namespace mono3d
