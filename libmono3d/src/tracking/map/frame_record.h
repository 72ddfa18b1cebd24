// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// A tracked frame, fixed to a keyframe whose pose and scale may still change: a FramePose by the
// numbers of a map.
struct FrameRecord {
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  int map_id = 0;
  KeyframeId keyframe = 0;
  Pose T_cam_keyframe;  // translation in the keyframe's own unit
};

FrameRecord MakeRecord(const View& view, const Map& map, KeyframeId keyframe);

// T_cam_world by the keyframe as it is now.
Pose PoseOf(const FrameRecord& record, const Map& map);

FramePose ToFramePose(const FrameRecord& record, const Map& map);

TrajectoryEntry ToEntry(const FrameRecord& record, const Map& map);

// All frames in the order of time, each by its map (`maps` in the order of their ids).
std::vector<TrajectoryEntry> ToTrajectory(const std::vector<FrameRecord>& records,
                                          const std::vector<std::unique_ptr<Map>>& maps);

}  // namespace mono3d::tracking
