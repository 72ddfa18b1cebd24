// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/published_poses.h"

#include <utility>

namespace mono3d::tracking {

void PublishedPoses::Publish(const std::vector<std::unique_ptr<Map>>& maps) {
  std::vector<KeyframePose> poses;
  for (const std::unique_ptr<Map>& map : maps) {
    for (KeyframeId id = 0; id < map->keyframes().size(); ++id) {
      poses.push_back({map->keyframe(id).id, map->id(), map->S_world_kf(id)});
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

}  // namespace mono3d::tracking
