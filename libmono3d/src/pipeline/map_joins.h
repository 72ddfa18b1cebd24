// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d {

// A map of the tracker that went into another one.
struct JoinedMap {
  int from = 0;
  int into = 0;
  Similarity S_into_from;  // of the worlds, by the newest keyframe of `from`
};

// Where keyframes are from some moment on.
struct MapChange {
  std::vector<JoinedMap> joined;
  std::vector<KeyframeCorrection> corrections;
};

// Reads from the tracker's corrections which of its maps have become one.
class MapJoins {
 public:
  // Every keyframe that the tracker hands out.
  void Remember(const Keyframe& keyframe);
  // In the order of `from`.
  std::vector<JoinedMap> Take(std::span<const KeyframeCorrection> corrections);

 private:
  struct Known {
    int map_id = 0;
    Pose T_world_cam;
    double scale = 1;  // over that of the time it was handed out
  };
  std::map<std::int64_t, Known> keyframes_;  // by id
};

// Poses of `joined.from` become such of `joined.into`.
void MoveEntries(const JoinedMap& joined, std::vector<TrajectoryEntry>& entries);

PointCloud Moved(const Similarity& S_into_from, PointCloud cloud);

// Each list stays as long as the points, or is left empty where one of the clouds has none.
void AppendCloud(const PointCloud& more, PointCloud& cloud);

}  // namespace mono3d
