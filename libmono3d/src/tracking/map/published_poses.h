// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "mono3d/image/keyframe_poses.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// The latest snapshot of where all keyframes are, for any thread to take.
class PublishedPoses {
 public:
  // Makes the next version, of all keyframes of the maps, also the culled ones. By one thread at a
  // time, which has the maps locked.
  void Publish(const std::vector<std::unique_ptr<Map>>& maps);
  // From any thread. Never null.
  KeyframePosesPtr Latest() const;
  // For the archives of image/state_archive.h; as Publish.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  mutable std::mutex mutex_;
  KeyframePosesPtr latest_ = std::make_shared<const KeyframePoses>();
};

}  // namespace mono3d::tracking
