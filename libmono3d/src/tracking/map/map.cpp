// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/map.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <utility>

namespace mono3d::tracking {

KeyframeId Map::AddKeyframe(View view) {
  const KeyframeId id = keyframes_.size();
  MapKeyframe keyframe;
  keyframe.view = std::move(view);
  keyframes_.push_back(std::move(keyframe));
  const auto at =
      std::upper_bound(in_flight_.begin(), in_flight_.end(), keyframes_[id].view.frame.index,
                       [&](std::int64_t index, KeyframeId other) {
                         return index < keyframes_[other].view.frame.index;
                       });
  num_final_ = std::min(num_final_, static_cast<std::size_t>(at - in_flight_.begin()));
  in_flight_.insert(at, id);
  const auto& points = keyframes_[id].view.points;
  for (std::size_t feature = 0; feature < points.size(); ++feature) {
    if (points[feature]) point(*points[feature]).observations.push_back({id, feature});
  }
  for (const std::optional<PointId>& point : points) {
    if (point) UpdatePoint(*point);
  }
  const std::vector<Covisible> closest = CovisibleKeyframes(id, 1);
  if (!closest.empty()) {
    keyframes_[id].S_world_visual = keyframes_[closest.front().keyframe].S_world_visual;
  }
  return id;
}

PointId Map::AddPoint(const Eigen::Vector3d& p_world) {
  MapPoint point;
  point.p_world = p_world;
  point.created_at = keyframes_.empty() ? 0 : keyframes_.size() - 1;
  PointId id;
  if (free_.empty()) {
    points_.push_back(std::move(point));
    id.index = static_cast<std::uint32_t>(points_.size() - 1);
  } else {
    id = {free_.back(), points_[free_.back()].generation};
    free_.pop_back();
    point.generation = id.generation;
    points_[id.index] = std::move(point);
  }
  Watch(id);
  return id;
}

std::vector<PointId> Map::TakeWatched() {
  std::vector<PointId> taken = std::exchange(watched_, {});
  std::erase_if(taken, [&](PointId id) { return !IsAlive(id); });
  std::ranges::sort(taken, {}, &PointId::index);
  taken.erase(std::unique(taken.begin(), taken.end()), taken.end());
  return taken;
}

std::vector<PointId> Map::PointIds() const {
  std::vector<PointId> ids;
  ids.reserve(points_.size());
  for (std::uint32_t index = 0; index < points_.size(); ++index) {
    if (points_[index].alive) ids.push_back({index, points_[index].generation});
  }
  return ids;
}

void Map::AddObservation(PointId point, const Observation& observation) {
  auto& observations = this->point(point).observations;
  const auto at = std::find_if(observations.begin(), observations.end(), [&](const Observation& o) {
    return o.keyframe > observation.keyframe;
  });
  observations.insert(at, observation);
  keyframes_[observation.keyframe].view.points[observation.feature] = point;
}

void Map::AddObservation(PointId point, KeyframeId keyframe, const Feature& feature) {
  View& view = keyframes_[keyframe].view;
  view.features.push_back(feature);
  view.points.emplace_back();
  AddObservation(point, {keyframe, view.features.size() - 1});
}

void Map::RemoveObservation(PointId point, const Observation& observation) {
  auto& observations = this->point(point).observations;
  std::erase_if(observations,
                [&](const Observation& o) { return o.keyframe == observation.keyframe; });
  keyframes_[observation.keyframe].view.points[observation.feature].reset();
  if (observations.size() < 2) RemovePoint(point);
}

void Map::RemovePoint(PointId point) {
  if (!IsAlive(point)) return;
  MapPoint& removed = points_[point.index];
  for (const Observation& observation : removed.observations) {
    keyframes_[observation.keyframe].view.points[observation.feature].reset();
  }
  removed.observations = std::vector<Observation>();
  removed.patch.reset();
  removed.alive = false;
  ++removed.generation;
  free_.push_back(point.index);
}

// Those from `first` on.
void Map::ListFree(std::size_t first) {
  for (std::size_t index = first; index < points_.size(); ++index) {
    if (!points_[index].alive) free_.push_back(static_cast<std::uint32_t>(index));
  }
}

void Map::MergePoints(PointId from, PointId to) {
  if (from == to) return;
  const std::vector<Observation> moved = point(from).observations;
  MapPoint& kept = point(to);
  if (point(from).depth_sigma < kept.depth_sigma) {
    kept.p_world = point(from).p_world;
    kept.depth_sigma = point(from).depth_sigma;
  }
  kept.num_predicted += point(from).num_predicted;
  kept.num_found += point(from).num_found;
  // Both were due in much the same keyframes, and each showed in others.
  kept.num_due_keyframes = std::max(kept.num_due_keyframes, point(from).num_due_keyframes);
  kept.num_showing_keyframes += point(from).num_showing_keyframes;
  RemovePoint(from);
  for (const Observation& observation : moved) {
    if (!FeatureOf(to, observation.keyframe)) AddObservation(to, observation);
  }
  UpdatePoint(to);
}

void Map::RemoveKeyframe(KeyframeId id, KeyframeId anchor) {
  MapKeyframe& keyframe = keyframes_[id];
  keyframe.alive = false;
  culled_.push_back(id);
  keyframe.anchor = anchor;
  keyframe.T_cam_anchor = keyframe.view.T_cam_world * T_cam_world(anchor).Inverse();
  for (std::size_t feature = 0; feature < keyframe.view.points.size(); ++feature) {
    const std::optional<PointId> point = keyframe.view.points[feature];
    if (!point) continue;
    RemoveObservation(*point, {id, feature});
    if (IsAlive(*point)) UpdatePoint(*point);
  }
  // A list that `= {}` empties would keep its memory.
  keyframe.view.features = std::vector<Feature>();
  keyframe.view.octaves = Octaves();
  keyframe.view.grid = FeatureGrid();
  keyframe.view.points = std::vector<std::optional<PointId>>();
}

void Map::TakeBackKeyframes(KeyframeId first) {
  KeyframeId last = first - 1;
  while (!keyframes_[last].alive) --last;
  for (KeyframeId id = first; id < keyframes_.size(); ++id) {
    if (keyframes_[id].alive) RemoveKeyframe(id, last);
  }
  for (const PointId id : PointIds()) {
    MapPoint& point = this->point(id);
    point.created_at = std::min(point.created_at, last);
    if (point.patch && point.patch_keyframe >= first) RemovePoint(id);
  }
  std::erase_if(constraints_, [&](const MapConstraint& constraint) {
    return constraint.keyframe >= first || constraint.anchor >= first;
  });
  keyframes_.erase(keyframes_.begin() + static_cast<std::ptrdiff_t>(first), keyframes_.end());
  ListAnew();
}

void Map::UpdatePoint(PointId id) {
  MapPoint& point = this->point(id);
  if (point.observations.empty()) return;
  // The newest ones: how the point looks from where the camera is.
  constexpr std::size_t kMaxDescriptors = 8;  // the cost grows with the square
  std::array<Descriptor, kMaxDescriptors> descriptors;
  const std::size_t count = std::min(kMaxDescriptors, point.observations.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Observation& seen = point.observations[point.observations.size() - count + i];
    descriptors[i] = keyframes_[seen.keyframe].view.features[seen.feature].descriptor;
  }
  point.descriptor = descriptors[MostTypical(std::span(descriptors).first(count))];
  UpdateGeometry(id);
}

void Map::UpdateGeometry(PointId id) {
  MapPoint& point = this->point(id);
  if (point.observations.empty()) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Observation& observation : point.observations) {
    sum += (keyframes_[observation.keyframe].view.Centre() - point.p_world).normalized();
  }
  point.towards_cameras = sum.normalized();
  // The scale as the newest keyframe sees it.
  const Observation& newest = point.observations.back();
  const View& view = keyframes_[newest.keyframe].view;
  const double distance = (view.Centre() - point.p_world).norm();
  point.max_distance = distance * scales_.Scale(view.features[newest.feature].level);
  point.min_distance = point.max_distance / scales_.Scale(scales_.num_levels() - 1);
}

std::optional<std::size_t> Map::FeatureOf(PointId point, KeyframeId keyframe) const {
  for (const Observation& observation : this->point(point).observations) {
    if (observation.keyframe == keyframe) return observation.feature;
  }
  return std::nullopt;
}

std::vector<Covisible> Map::CovisibleKeyframes(KeyframeId keyframe) const {
  return KeyframesSeeing(keyframes_[keyframe].view.points, keyframe);
}

std::vector<Covisible> Map::CovisibleKeyframes(KeyframeId keyframe, std::size_t max_count) const {
  std::vector<Covisible> covisible = CovisibleKeyframes(keyframe);
  covisible.resize(std::min(covisible.size(), max_count));
  return covisible;
}

std::vector<Covisible> Map::KeyframesSeeing(const std::vector<std::optional<PointId>>& points,
                                            std::optional<KeyframeId> excluded) const {
  std::vector<int> counts(keyframes_.size(), 0);
  for (const std::optional<PointId>& point : points) {
    if (!point || !IsAlive(*point)) continue;
    for (const Observation& observation : this->point(*point).observations) {
      ++counts[observation.keyframe];
    }
  }
  if (excluded) counts[*excluded] = 0;
  std::vector<Covisible> covisible;
  for (KeyframeId id = 0; id < counts.size(); ++id) {
    if (counts[id] > 0) covisible.push_back({id, counts[id]});
  }
  // Newer first among equals.
  std::sort(covisible.begin(), covisible.end(), [](const Covisible& a, const Covisible& b) {
    return a.num_shared != b.num_shared ? a.num_shared > b.num_shared : a.keyframe > b.keyframe;
  });
  return covisible;
}

// Keyframes and points are others: all is to be looked at again.
void Map::ListAnew() {
  in_flight_.resize(keyframes_.size());
  std::iota(in_flight_.begin(), in_flight_.end(), KeyframeId{0});
  std::ranges::stable_sort(in_flight_, {},
                           [&](KeyframeId id) { return keyframes_[id].view.frame.index; });
  num_final_ = 0;
  watched_ = PointIds();
  culled_ = in_flight_;
  std::erase_if(culled_, [&](KeyframeId id) { return keyframes_[id].alive; });
}

std::span<const KeyframeId> Map::FromFirstNotFinal() {
  while (num_final_ < in_flight_.size() && keyframes_[in_flight_[num_final_]].is_finalised) {
    ++num_final_;
  }
  return std::span(in_flight_).subspan(num_final_);
}

std::vector<float> Map::Depths(const View& view) const {
  std::vector<float> depths;
  for (const std::optional<PointId>& point : view.points) {
    if (!point || !IsAlive(*point)) continue;
    const double z = (view.T_cam_world * this->point(*point).p_world).z();
    if (z > 0) depths.push_back(static_cast<float>(z));
  }
  return depths;
}

Pose Map::T_cam_world(KeyframeId id) const {
  const MapKeyframe& keyframe = keyframes_[id];
  if (keyframe.alive) return keyframe.view.T_cam_world;
  // From the one that is alive on. Not by recursion: a map that was read may have a chain of any
  // length.
  std::vector<KeyframeId> chain = {id};
  while (!keyframes_[keyframes_[chain.back()].anchor].alive) {
    chain.push_back(keyframes_[chain.back()].anchor);
  }
  Pose T_cam_world = keyframes_[keyframes_[chain.back()].anchor].view.T_cam_world;
  for (std::size_t i = chain.size(); i-- > 0;) {
    T_cam_world = keyframes_[chain[i]].T_cam_anchor * T_cam_world;
  }
  return T_cam_world;
}

void Map::Correct(const std::vector<KeyframeId>& keyframes,
                  const std::vector<Similarity>& S_cam_world) {
  std::vector<std::optional<Similarity>> S_new_old(keyframes_.size());  // of the world around it
  std::vector<double> ratio(keyframes_.size(), 1);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const KeyframeId id = keyframes[i];
    S_new_old[id] = S_cam_world[i].Inverse() * Similarity(1, keyframes_[id].view.T_cam_world);
    ratio[id] = 1 / S_cam_world[i].scale();
  }
  for (MapPoint& point : points_) {
    if (!point.alive || point.observations.empty()) continue;
    // The one in the middle of its life is nearest to where the point was measured from.
    const KeyframeId by = point.observations[point.observations.size() / 2].keyframe;
    if (S_new_old[by]) point.p_world = *S_new_old[by] * point.p_world;
  }
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Pose& pose = S_cam_world[i].pose();
    keyframes_[keyframes[i]].view.T_cam_world =
        Pose(pose.rotation(), ratio[keyframes[i]] * pose.translation());
  }
  ScaleAround(ratio);
  for (const PointId id : PointIds()) UpdateGeometry(id);
}

void Map::ScaleAround(std::vector<double> ratios) {
  for (KeyframeId id = 0; id < keyframes_.size(); ++id) {
    MapKeyframe& keyframe = keyframes_[id];
    if (!keyframe.alive) {
      ratios[id] = ratios[keyframe.anchor];  // which is older, so has its own already
      keyframe.T_cam_anchor =
          Pose(keyframe.T_cam_anchor.rotation(), ratios[id] * keyframe.T_cam_anchor.translation());
    }
    keyframe.scale *= ratios[id];
    keyframe.view.shutter.Rescale(ratios[id]);
  }
}

void Map::ForgetPositions() {
  for (MapKeyframe& keyframe : keyframes_) keyframe.S_world_visual = {};
}

void Map::Append(Map&& other, const Similarity& S_world_other) {
  const KeyframeId first_keyframe = keyframes_.size();
  const auto first_point = static_cast<std::uint32_t>(points_.size());
  const double scale = S_world_other.scale();
  for (MapPoint& point : other.points_) {
    point.p_world = S_world_other * point.p_world;
    point.towards_cameras = S_world_other.pose().rotation() * point.towards_cameras;
    point.min_distance *= scale;
    point.max_distance *= scale;
    point.created_at += first_keyframe;
    point.patch_keyframe += first_keyframe;
    for (Observation& observation : point.observations) observation.keyframe += first_keyframe;
    points_.push_back(std::move(point));
  }
  for (MapKeyframe& keyframe : other.keyframes_) {
    keyframe.view.T_cam_world = (S_world_other * keyframe.view.T_cam_world.Inverse()).Inverse();
    keyframe.T_cam_anchor =
        Pose(keyframe.T_cam_anchor.rotation(), scale * keyframe.T_cam_anchor.translation());
    keyframe.anchor += first_keyframe;
    keyframe.scale *= scale;
    keyframe.S_world_visual = S_world_other * keyframe.S_world_visual * S_world_other.Inverse();
    keyframe.view.shutter.Rescale(scale);
    for (std::optional<PointId>& point : keyframe.view.points) {
      if (point) point->index += first_point;
    }
    keyframes_.push_back(std::move(keyframe));
  }
  for (MapConstraint& constraint : other.constraints_) {
    constraint.keyframe += first_keyframe;
    constraint.anchor += first_keyframe;
    constraints_.push_back(constraint);
  }
  ListFree(first_point);
  ListAnew();
  other.points_.clear();
  other.keyframes_.clear();
  other.constraints_.clear();
  other.free_.clear();
  other.ListAnew();
}

void Map::Rescale(double factor) {
  for (MapPoint& point : points_) {
    point.p_world *= factor;
    point.min_distance *= factor;
    point.max_distance *= factor;
  }
  for (MapKeyframe& keyframe : keyframes_) {
    Pose& T = keyframe.view.T_cam_world;
    T = Pose(T.rotation(), T.translation() * factor);
    Pose& T_anchor = keyframe.T_cam_anchor;
    T_anchor = Pose(T_anchor.rotation(), T_anchor.translation() * factor);
    const Similarity& moved = keyframe.S_world_visual;
    keyframe.S_world_visual = {moved.scale(),
                               Pose(moved.pose().rotation(), moved.pose().translation() * factor)};
    keyframe.view.shutter.Rescale(factor);
  }
}

}  // namespace mono3d::tracking
