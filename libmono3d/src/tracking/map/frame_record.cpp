// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/frame_record.h"

#include <algorithm>

namespace mono3d::tracking {

FrameRecord MakeRecord(const View& view, const Map& map, KeyframeId keyframe) {
  const Pose T_cam_keyframe = view.T_cam_world * map.T_cam_world(keyframe).Inverse();
  return {
      view.frame.index, view.frame.timestamp_s, map.id(), keyframe,
      Pose(T_cam_keyframe.rotation(), T_cam_keyframe.translation() / map.keyframe(keyframe).scale)};
}

Pose PoseOf(const FrameRecord& record, const Map& map) {
  const double scale = map.keyframe(record.keyframe).scale;
  const Pose T_cam_keyframe(record.T_cam_keyframe.rotation(),
                            scale * record.T_cam_keyframe.translation());
  return T_cam_keyframe * map.T_cam_world(record.keyframe);
}

FramePose ToFramePose(const FrameRecord& record, const Map& map) {
  return {record.frame_index, record.timestamp_s, map.keyframe(record.keyframe).id,
          record.T_cam_keyframe.Inverse()};
}

TrajectoryEntry ToEntry(const FrameRecord& record, const Map& map) {
  return {record.frame_index, record.timestamp_s, record.map_id, PoseOf(record, map).Inverse()};
}

std::vector<TrajectoryEntry> ToTrajectory(const std::vector<FrameRecord>& records,
                                          const std::vector<std::unique_ptr<Map>>& maps) {
  std::vector<TrajectoryEntry> entries;
  for (const FrameRecord& record : records) {
    entries.push_back(ToEntry(record, *maps[static_cast<std::size_t>(record.map_id)]));
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.frame_index < b.frame_index; });
  return entries;
}

}  // namespace mono3d::tracking
