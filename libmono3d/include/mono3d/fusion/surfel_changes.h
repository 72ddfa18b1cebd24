// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace MONO3D_EXPORT mono3d {

// A depth map of the model, to which surfels are anchored.
struct SurfelAnchor {
  std::uint32_t number = 0;  // in the model, from 0 on
  std::int64_t keyframe_id = 0;
  std::int64_t frame_index = 0;
  Similarity S_world_anchor;  // by the poses that the model was given last
  double timestamp_s = 0;     // of the frame
};

// The surfels of one anchor.
struct SurfelChunk {
  std::uint32_t anchor = 0;
  // In the frame of the anchor's camera, in the unit of its depth map; with all fields, whatever
  // their confidence. Shared and never changed.
  std::shared_ptr<const PointCloud> surfels;
};

// What has become of a model since a viewer looked last. A moved keyframe changes no chunk: what
// the viewer has goes where `anchors` says.
struct SurfelChanges {
  std::uint64_t version = 0;          // to ask with next time
  std::vector<SurfelAnchor> anchors;  // all of them; a chunk of another is no more
  std::vector<SurfelChunk> changed;   // chunks whose surfels have changed since
};

}  // namespace mono3d
