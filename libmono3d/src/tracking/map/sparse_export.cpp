// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/sparse_export.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

namespace mono3d::tracking {
SparseModel ToSparseModel(const Map& map) {
  SparseModel model;
  model.camera = map.camera();
  std::vector<std::optional<std::size_t>> position(map.points().size());
  for (const PointId id : map.PointIds()) {
    const MapPoint& point = map.point(id);
    position[id.index] = model.points.size();
    model.points.push_back({point.p_world, point.colour});
  }
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    const MapKeyframe& keyframe = map.keyframe(id);
    if (!keyframe.alive) continue;
    const View& view = keyframe.view;
    SparseImage& image = model.images.emplace_back();
    image.id = static_cast<std::int64_t>(id);
    image.name = view.frame.name;
    image.T_world_cam = view.T_cam_world.Inverse();
    const CameraVelocity& velocity = view.shutter.velocity();
    if (!(velocity == CameraVelocity())) image.velocity = velocity;
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      if (!view.points[i] || !position[view.points[i]->index]) continue;
      const Eigen::Vector2d pixel =
          map.AtMiddleLine(view, view.features[i].pixel, map.point(*view.points[i]).p_world);
      image.observations.push_back({pixel, position[view.points[i]->index]});
    }
  }
  return model;
}

void NumberByFrames(const Map& map, SparseModel& model) {
  std::set<std::int64_t> indices;
  for (const SparseImage& image : model.images) {
    indices.insert(map.keyframe(static_cast<KeyframeId>(image.id)).view.frame.index);
  }
  if (indices.size() < model.images.size()) return;
  for (SparseImage& image : model.images) {
    image.id = map.keyframe(static_cast<KeyframeId>(image.id)).view.frame.index;
  }
  std::sort(model.images.begin(), model.images.end(),
            [](const SparseImage& a, const SparseImage& b) { return a.id < b.id; });
}

}  // namespace mono3d::tracking
