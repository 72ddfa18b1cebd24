// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// Where a scripted tracker has its keyframes: a new snapshot after each change.
class KeyframeTable {
 public:
  void Set(std::int64_t keyframe_id, int map_id, const Similarity& S_world_kf) {
    poses_[keyframe_id] = {keyframe_id, map_id, S_world_kf};
    snapshot_.reset();
  }
  void Set(std::int64_t keyframe_id, int map_id, const Pose& T_world_cam) {
    Set(keyframe_id, map_id, Similarity(1, T_world_cam));
  }

  // All keyframes of map `from` go into map `into`.
  void Join(int from, int into, const Similarity& S_into_from) {
    for (auto& [id, pose] : poses_) {
      if (pose.map_id != from) continue;
      pose.map_id = into;
      pose.S_world_kf = S_into_from * pose.S_world_kf;
    }
    snapshot_.reset();
  }

  KeyframePosesPtr Poses() const {
    if (!snapshot_) {
      std::vector<KeyframePose> list;
      for (const auto& [id, pose] : poses_) list.push_back(pose);
      snapshot_ = std::make_shared<KeyframePoses>(++version_, std::move(list));
    }
    return snapshot_;
  }

  // Keyframe i is frame i.
  std::vector<TrajectoryEntry> Entries(double frame_interval_s) const {
    std::vector<TrajectoryEntry> entries;
    for (const auto& [id, pose] : poses_) {
      entries.push_back(
          {id, frame_interval_s * static_cast<double>(id), pose.map_id, pose.T_world_cam()});
    }
    return entries;
  }

 private:
  std::map<std::int64_t, KeyframePose> poses_;
  mutable KeyframePosesPtr snapshot_;
  mutable std::uint64_t version_ = 0;
};

}  // namespace mono3d
