// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/fusion/surfel_changes.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/image/keyframe_poses.h"
#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

// Where a map is on the earth, by the positions that there were at some moment.
struct PlaceOfMap {
  int map_id = 0;
  Georeference georeference;
};

// What there is at one moment.
struct PipelineSnapshot {
  // The latest frame: what became of it, and its pose by `keyframe_poses`.
  std::int64_t frame_index = -1;  // none yet
  double timestamp_s = 0;
  TrackingStatus status = TrackingStatus::kNotInitialised;
  TrackingLoss loss = TrackingLoss::kOther;  // where it has no pose: why
  std::string reason;                        // the same in words
  std::optional<TrajectoryEntry> pose;
  KeyframePosesPtr keyframe_poses;  // never null
  PipelineCounts counts;
  std::int64_t num_surfels = 0;  // in the current model
  ModelHealth health;            // of the current model
  // The current model as it was published last: what has changed in it since the version that was
  // asked about, all of it since version 0. The world is that of map `model_map_id`, by
  // `model_poses`.
  SurfelChanges surfels;
  int model_map_id = 0;
  KeyframePosesPtr model_poses;  // null where nothing was published yet
  // The latest one that was found, live every few seconds, else each time that the map has
  // grown by half; null where there are no positions, or they do not tell it yet. The map may have
  // been corrected a little since.
  std::shared_ptr<const PlaceOfMap> place;
};

// The surfels that have changed in the world, without those of less confidence than an export would
// have with these options, of which min_confidence and min_share count. Those of a snapshot since
// version 0 are the model, though not yet without what only an export finds: surfels that stand
// alone, or that more depth maps contradict than confirm.
PointCloud ToPointCloud(const SurfelChanges& surfels, const SurfelExportOptions& options = {});

}  // namespace mono3d
