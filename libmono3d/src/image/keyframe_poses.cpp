// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/keyframe_poses.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "mono3d/core/error.h"

namespace mono3d {

Pose RelativePose(const Similarity& S_world_kf, const Pose& T_world_cam) {
  const Pose& T_world_kf = S_world_kf.pose();
  const Eigen::Quaterniond R_kf_world = T_world_kf.rotation().conjugate();
  return {
      R_kf_world * T_world_cam.rotation(),
      R_kf_world * ((T_world_cam.translation() - T_world_kf.translation()) / S_world_kf.scale())};
}

KeyframePoses::KeyframePoses(std::uint64_t version, std::vector<KeyframePose> poses)
    : version_(version), poses_(std::move(poses)) {
  // As they come from a tracker with one map.
  if (!std::ranges::is_sorted(poses_, {}, &KeyframePose::keyframe_id)) {
    std::ranges::sort(poses_, {}, &KeyframePose::keyframe_id);
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const KeyframePose& pose = poses_[i];
    const auto name = [&] { return "keyframe " + std::to_string(pose.keyframe_id); };
    if (i > 0 && poses_[i - 1].keyframe_id == pose.keyframe_id) {
      throw Error(ErrorParts{.what = "two poses",
                             .where = name(),
                             .expected = "one",
                             .found = {},
                             .code = ErrorCode::kInvalidArgument});
    }
    const double scale = pose.S_world_kf.scale();
    if (!pose.T_world_cam().Matrix().allFinite() || !std::isfinite(scale) || scale <= 0) {
      throw Error(ErrorParts{.what = "pose is not finite, or its scale is not positive",
                             .where = name(),
                             .expected = {},
                             .found = {}});
    }
  }
}

const KeyframePose* KeyframePoses::Find(std::int64_t keyframe_id) const {
  const auto found = std::ranges::lower_bound(poses_, keyframe_id, {}, &KeyframePose::keyframe_id);
  return found == poses_.end() || found->keyframe_id != keyframe_id ? nullptr : &*found;
}

const KeyframePose& KeyframePoses::At(std::int64_t keyframe_id) const {
  const KeyframePose* found = Find(keyframe_id);
  if (found != nullptr) return *found;
  throw Error(ErrorParts{.what = "no pose",
                         .where = "keyframe " + std::to_string(keyframe_id),
                         .expected = "a keyframe of this tracker",
                         .found = {},
                         .code = ErrorCode::kInvalidArgument});
}

std::optional<TrajectoryEntry> InWorld(const FramePose& frame, const KeyframePoses& poses) {
  const KeyframePose* keyframe = poses.Find(frame.keyframe_id);
  if (keyframe == nullptr) return std::nullopt;
  return TrajectoryEntry{frame.frame_index, frame.timestamp_s, keyframe->map_id,
                         keyframe->S_world_kf * frame.T_kf_cam};
}

std::vector<MapJoin> FindMapJoins(const KeyframePoses& before, const KeyframePoses& after) {
  std::map<int, MapJoin> joins;  // by `from`; poses come by ascending id, the newest last
  auto is = after.poses().begin();
  for (const KeyframePose& was : before.poses()) {
    while (is != after.poses().end() && is->keyframe_id < was.keyframe_id) ++is;
    if (is == after.poses().end()) break;
    if (is->keyframe_id != was.keyframe_id || is->map_id == was.map_id) continue;
    joins[was.map_id] = {was.map_id, is->map_id, is->S_world_kf * was.S_world_kf.Inverse()};
  }
  std::vector<MapJoin> sorted;
  for (const auto& [from, join] : joins) sorted.push_back(join);
  return sorted;
}

}  // namespace mono3d
