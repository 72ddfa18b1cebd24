// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/published_poses.h"

#include <algorithm>
#include <utility>

#include "image/image_state.h"
#include "image/state_archive.h"

namespace mono3d::tracking {

void PublishedPoses::Publish(const std::vector<std::unique_ptr<Map>>& maps) {
  std::vector<KeyframePose> poses;
  std::vector<Pose> T_cam_world;  // of one map
  for (const std::unique_ptr<Map>& map : maps) {
    T_cam_world.clear();
    for (KeyframeId id = 0; id < map->keyframes().size(); ++id) {
      const MapKeyframe& keyframe = map->keyframe(id);
      // Anchors may be culled in their turn; they are older, so known by now.
      const bool is_known = !keyframe.alive && keyframe.anchor < id;
      T_cam_world.push_back(is_known ? keyframe.T_cam_anchor * T_cam_world[keyframe.anchor]
                                     : map->T_cam_world(id));
      poses.push_back({keyframe.id, map->id(), {keyframe.scale, T_cam_world.back().Inverse()}});
    }
  }
  auto next = std::make_shared<const KeyframePoses>(Latest()->version() + 1, std::move(poses));
  const std::lock_guard lock(mutex_);
  latest_ = std::move(next);
}

KeyframePosesPtr PublishedPoses::Latest() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

template <typename Archive>
void PublishedPoses::ExchangeState(Archive& archive) {
  const KeyframePosesPtr latest = Latest();
  std::uint64_t version = latest->version();
  std::vector<KeyframePose> poses(latest->poses().begin(), latest->poses().end());
  archive.Number(version);
  constexpr std::size_t kPosesOfSection = 64;
  archive.Sections(poses, kPosesOfSection,
                   [&](KeyframePose& pose) { mono3d::ExchangeState(archive, pose); });
  if constexpr (Archive::kReads) {
    const auto is_earlier = [](const KeyframePose& a, const KeyframePose& b) {
      return a.keyframe_id >= b.keyframe_id;
    };
    if (std::ranges::adjacent_find(poses, is_earlier) != poses.end()) {
      archive.Refuse("contradicts itself");
    }
    auto restored = std::make_shared<const KeyframePoses>(version, std::move(poses));
    const std::lock_guard lock(mutex_);
    latest_ = std::move(restored);
  }
}

template void PublishedPoses::ExchangeState(StateWriter&);
template void PublishedPoses::ExchangeState(StateReader&);

}  // namespace mono3d::tracking
