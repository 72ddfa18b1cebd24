// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/similarity.h"

namespace MONO3D_EXPORT mono3d {

// Where a keyframe is. Its camera frame, in the keyframe's own unit of length, into the world of
// its map. The own unit is fixed when the keyframe joins its map: what is made of the
// keyframe (depth maps, surfels, frames relative to it) never has to be rescaled.
struct KeyframePose {
  std::int64_t keyframe_id = 0;
  int map_id = 0;  // worlds of different maps have nothing in common
  Similarity S_world_kf;

  // The camera's pose in the world, in the world's unit.
  const Pose& T_world_cam() const { return S_world_kf.pose(); }
};

// A camera in the camera frame of a keyframe, in the keyframe's own unit.
Pose RelativePose(const Similarity& S_world_kf, const Pose& T_world_cam);

// The poses of all keyframes of a tracker at one moment. Immutable: every adjustment, closed loop
// or join of maps makes a new one with a higher version. Safe to read from any thread.
class KeyframePoses {
 public:
  KeyframePoses() = default;
  // Throws Error on two poses of one keyframe, or one that is not finite.
  KeyframePoses(std::uint64_t version, std::vector<KeyframePose> poses);

  std::uint64_t version() const { return version_; }
  // By ascending keyframe id.
  std::span<const KeyframePose> poses() const { return poses_; }
  // Null where the keyframe is not known. O(log n).
  const KeyframePose* Find(std::int64_t keyframe_id) const;
  // Throws Error where the keyframe is not known.
  const KeyframePose& At(std::int64_t keyframe_id) const;

 private:
  std::uint64_t version_ = 0;
  std::vector<KeyframePose> poses_;
};

using KeyframePosesPtr = std::shared_ptr<const KeyframePoses>;

// A tracked frame, fixed to a keyframe: it follows wherever the keyframe goes.
struct FramePose {
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  std::int64_t keyframe_id = 0;
  Pose T_kf_cam;  // translation in the keyframe's own unit
};

// A frame in the world of its map.
struct TrajectoryEntry {
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  int map_id = 0;
  Pose T_world_cam;
};

// Nothing where `poses` does not know the keyframe.
std::optional<TrajectoryEntry> InWorld(const FramePose& frame, const KeyframePoses& poses);

// Two maps that have become one between two snapshots.
struct MapJoin {
  int from = 0;  // this map is no more
  int into = 0;
  Similarity S_into_from;  // of their worlds, by the newest keyframe of `from`
};

// By ascending `from`. `before` and `after` are snapshots of the same tracker.
std::vector<MapJoin> FindMapJoins(const KeyframePoses& before, const KeyframePoses& after);

}  // namespace mono3d
