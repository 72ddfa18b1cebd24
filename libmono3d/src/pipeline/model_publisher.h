// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "mono3d/geometry/point_cloud.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// The surfels of a model for who watches it grow.
struct PublishedModel {
  std::uint64_t version = 0;  // 0: nothing yet
  int map_id = 0;
  KeyframePosesPtr poses;  // that the surfels follow
  std::shared_ptr<const PointCloud> surfels;
};

// Passes a model that grows in one thread to others, as often as that takes no more than a tenth of
// the thread's time: to export a million surfels takes far longer than to fuse a depth map.
class ModelPublisher {
 public:
  // From any thread: the latest publication, with surfels where it is newer than `since_version`.
  // Somebody is interested from the first call on.
  PublishedModel Latest(std::uint64_t since_version);

  // The rest by the thread of the model.
  void NoteChange() { has_changed_ = true; }
  // When the next publication is due, in seconds of the clock; nothing while none is.
  std::optional<double> Due_s() const;
  // Publishes what `make` returns if a publication is due. The version is given here.
  void PublishIfDue(const std::function<PublishedModel()>& make);

 private:
  mutable std::mutex mutex_;
  PublishedModel latest_;
  bool is_wanted_ = false;

  bool has_changed_ = false;  // since the latest publication
  double earliest_s_ = 0;     // of the next publication
};

}  // namespace mono3d
