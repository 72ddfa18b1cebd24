// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What leaves the tracker as a whole and comes back: points, sparse models, saved maps.

#include <algorithm>
#include <cstddef>
#include <utility>

#include "mono3d/core/error.h"
#include "tracking/map/map_bytes.h"
#include "tracking/map/sparse_export.h"
#include "tracking/orb_tracker.h"

namespace mono3d::tracking {

PointCloud OrbTracker::MapPoints(int map_id) const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  PointCloud cloud;
  if (map_id < 0 || static_cast<std::size_t>(map_id) >= maps_.size()) return cloud;
  for (const MapPoint& point : maps_[static_cast<std::size_t>(map_id)]->points()) {
    if (!point.alive) continue;
    cloud.points.push_back(point.p_world.cast<float>());
    cloud.normals.push_back(point.towards_cameras.cast<float>());
    cloud.observations.push_back(static_cast<std::uint32_t>(point.observations.size()));
  }
  return cloud;
}

SparseModel OrbTracker::Sparse(int map_id) const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (map_id < 0 || static_cast<std::size_t>(map_id) >= maps_.size()) return {};
  const Map& of = *maps_[static_cast<std::size_t>(map_id)];
  SparseModel model = ToSparseModel(of);
  NumberByFrames(of, model);
  return model;
}

std::string OrbTracker::SaveMap() const {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (maps_.empty()) throw Error("there is no map to save: tracking has not started");
  std::vector<std::vector<FrameRecord>> frames(maps_.size());
  for (const FrameRecord& record : records_) {
    frames[static_cast<std::size_t>(record.map_id)].push_back(record);
  }
  const auto most =
      std::max_element(frames.begin(), frames.end(),
                       [](const auto& a, const auto& b) { return a.size() < b.size(); });
  return ToBytes(*maps_[static_cast<std::size_t>(most - frames.begin())], options_.features, *most);
}

void OrbTracker::LoadMap(std::string_view bytes, const std::string& where) {
  const std::unique_ptr<TrackingLock> lock = Lock();
  if (camera_) throw UsageError("a map must be loaded before the first frame");
  SavedMap saved = FromBytes(bytes, where);
  const FeatureOptions& features = options_.features;
  if (saved.features.num_levels != features.num_levels ||
      saved.features.scale_factor != features.scale_factor) {
    throw UsageError(ErrorParts{.what = "saved map has other pyramid levels than tracking.features",
                                .where = where,
                                .expected = std::to_string(features.num_levels) + " levels by " +
                                            std::to_string(features.scale_factor),
                                .found = std::to_string(saved.features.num_levels) + " levels by " +
                                         std::to_string(saved.features.scale_factor)});
  }
  camera_ = saved.map->camera();
  current_ = maps_.size();
  maps_.push_back(std::move(saved.map));
  records_ = std::move(saved.frames);
  num_loaded_keyframes_ = map().keyframes().size();
  is_map_loaded_ = true;
  PlaceIndex& places = places_.emplace_back();
  for (KeyframeId id = 0; id < map().keyframes().size(); ++id) {
    const MapKeyframe& keyframe = map().keyframe(id);
    next_keyframe_id_ = std::max(next_keyframe_id_, keyframe.id + 1);
    if (!keyframe.alive) continue;
    places.Add(id, FeaturesWithPoints(keyframe.view));
    newest_ = id;
  }
  reference_ = newest_;
  PublishPoses();
}

// The first frame after a map was loaded tells whether it goes on with the same footage. If not,
// the frames of the map are none of this footage's trajectory: times and indices would mix.
void OrbTracker::JoinLoadedFrames(const Frame& first) {
  is_map_loaded_ = false;
  const bool goes_on =
      std::all_of(records_.begin(), records_.end(), [&](const FrameRecord& record) {
        return record.frame_index < first.index && record.timestamp_s < first.timestamp_s;
      });
  if (goes_on) {
    num_loaded_keyframes_ = 0;
  } else {
    records_.clear();
  }
}

}  // namespace mono3d::tracking
