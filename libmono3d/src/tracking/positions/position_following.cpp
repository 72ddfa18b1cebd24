// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/position_following.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/smooth_path.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/sight_lines.h"
#include "tracking/optimisation/keyframe_graph.h"
#include "tracking/optimisation/map_constraints.h"
#include "tracking/positions/image_drift.h"

namespace mono3d::tracking {
namespace {

// The camera centres in the world.
std::vector<TimedPoint> CentresOf(std::span<const TrajectoryEntry> frames) {
  std::vector<TimedPoint> centres;
  for (const TrajectoryEntry& frame : frames) {
    centres.push_back({frame.timestamp_s, frame.T_world_cam.translation()});
  }
  return centres;
}

// The living keyframes in the order of flight.
std::vector<KeyframeId> LivingInFlight(const Map& map) {
  std::vector<KeyframeId> living = map.InOrderOfFlight();
  std::erase_if(living, [&](KeyframeId id) { return !map.keyframe(id).alive; });
  return living;
}

// A typical depth: the median over keyframes here and there of the median of their points.
double TypicalDepth(const Map& map, const std::vector<KeyframeId>& keyframes) {
  constexpr std::size_t kMostKeyframes = 50;
  const std::size_t stride = std::max<std::size_t>(1, keyframes.size() / kMostKeyframes);
  std::vector<float> depths;
  for (std::size_t i = 0; i < keyframes.size(); i += stride) {
    const auto depth =
        static_cast<float>(UpperMedianOrZero(map.Depths(map.keyframe(keyframes[i]).view)));
    if (depth > 0) depths.push_back(depth);
  }
  const double typical = UpperMedianOrZero(std::move(depths));
  return typical > 0 ? typical : 1;
}

// What points are off by in the images: as assumed, or as their residuals have it where these are
// larger; over keyframes here and there.
double PointSigma(const Map& map, const std::vector<KeyframeId>& keyframes) {
  constexpr std::size_t kMostKeyframes = 50;
  const double median_of_two = std::sqrt(2 * std::numbers::ln2);  // of a distance, in sigma
  const std::size_t stride = std::max<std::size_t>(1, keyframes.size() / kMostKeyframes);
  std::vector<double> sigmas_px;
  std::vector<double> distances;  // in what is assumed
  for (std::size_t i = 0; i < keyframes.size(); i += stride) {
    const View& view = map.keyframe(keyframes[i]).view;
    // Each line of a rolling shutter has a pose of its own.
    const bool is_at_once = view.frame.sensor.shutter.IsGlobal();
    for (std::size_t feature = 0; feature < view.points.size(); ++feature) {
      if (!view.points[feature]) continue;
      const Feature& seen = view.features[feature];
      sigmas_px.push_back(seen.sigma_px);
      const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*view.points[feature]).p_world;
      if (!is_at_once || p_cam.z() <= 0) continue;
      distances.push_back((map.camera().Project(p_cam) - seen.pixel).norm() / seen.sigma_px);
    }
  }
  constexpr double kUnknown_px = 1.0 / 3;  // as of a good image
  if (sigmas_px.empty()) return kUnknown_px;
  return UpperMedian(std::move(sigmas_px)) *
         std::max(1.0, UpperMedianOrZero(std::move(distances)) / median_of_two);
}

// Where vision alone has a keyframe.
Similarity S_cam_visual(const Map& map, KeyframeId id) {
  return Similarity(1, map.T_cam_world(id)) * map.keyframe(id).S_world_visual;
}

class MapPath {
 public:
  MapPath(const Map& map, std::span<const TrajectoryEntry> frames, const CameraPositions& positions)
      : map_(map), keyframes_(LivingInFlight(map)), node_of_(map.keyframes().size()) {
    for (std::size_t node = 0; node < keyframes_.size(); ++node) {
      node_of_[keyframes_[node]] = node;
      path_.S_metric_kf.push_back(positions.S_metric_map *
                                  Similarity(1, map.T_cam_world(keyframes_[node]).Inverse()));
    }
    path_.has_vertical = positions.has_vertical;
    path_.clock_offset_s = positions.clock_offset_s;
    path_.clock_offset_sigma_s = positions.clock_offset_sigma_s;
    path_.typical_horizontal_m = positions.typical_horizontal_m;
    path_.typical_vertical_m = positions.typical_vertical_m;
    path_.worth = positions.worth;
    if (keyframes_.empty()) return;
    AddEdges();
    AddPositions(frames, positions);
    for (const KnownPoint& point : positions.points) {
      AddKnownPoint(frames, point, positions.S_metric_map);
    }
    std::ranges::stable_sort(path_.positions, {}, [](const PathPosition& position) {
      return std::pair(position.node, position.time_s);
    });
  }

  PositionedPath& path() { return path_; }
  const std::vector<KeyframeId>& keyframes() const { return keyframes_; }

 private:
  SimilarityEdge Edge(std::size_t a, std::size_t b) const {
    return {a, b, S_cam_visual(map_, keyframes_[b]) * S_cam_visual(map_, keyframes_[a]).Inverse()};
  }

  void AddEdges() {
    std::vector<int> num_shared;  // with the keyframe before
    for (std::size_t node = 1; node < keyframes_.size(); ++node) {
      path_.edges.push_back(Edge(node - 1, node));
    }
    for (std::size_t node = 0; node < keyframes_.size(); ++node) {
      for (const Covisible& other : map_.CovisibleKeyframes(keyframes_[node])) {
        const std::size_t at = *node_of_[other.keyframe];
        if (at + 1 == node) num_shared.push_back(other.num_shared);
        if (other.num_shared < kMinSharedOfEdge || at + kMinReturnGap > node) continue;
        path_.edges.push_back(Edge(at, node));
      }
    }
    // The sigma of edges is for the fewest points that make one.
    const double typical = std::max(kMinSharedOfEdge, UpperMedianOrZero(std::move(num_shared)));
    const double edge_sigma = PointSigma(map_, keyframes_) * EdgeSigma(map_.camera()) *
                              std::sqrt(kMinSharedOfEdge / typical);
    path_.drift = PathDrift{edge_sigma, edge_sigma};
    path_.shift = edge_sigma * TypicalDepth(map_, keyframes_);  // what that is at a typical depth
  }

  // Of a position that belongs to a frame by its name: that frame's.
  static std::optional<double> TimeOf(std::span<const TrajectoryEntry> frames,
                                      const CameraPosition& position) {
    if (position.frame_index < 0) return position.time_s;
    const auto frame =
        std::ranges::lower_bound(frames, position.frame_index, {}, &TrajectoryEntry::frame_index);
    const bool is_there = frame != frames.end() && frame->frame_index == position.frame_index;
    return is_there ? std::optional(frame->timestamp_s) : std::nullopt;
  }

  double TimeOf(std::size_t node) const {
    return map_.keyframe(keyframes_[node]).view.frame.timestamp_s;
  }

  // The node that is nearest in time.
  std::size_t NodeAt(double time_s) const {
    std::size_t nearest = 0;
    for (std::size_t node = 1; node < keyframes_.size(); ++node) {
      if (std::abs(TimeOf(node) - time_s) < std::abs(TimeOf(nearest) - time_s)) nearest = node;
    }
    return nearest;
  }

  // One for each time that the path comes past the point: where the lines of sight meet that are of
  // about the same time, so that no drift is between them.
  void AddKnownPoint(std::span<const TrajectoryEntry> frames, const KnownPoint& point,
                     const Similarity& S_metric_map) {
    std::vector<std::pair<std::size_t, SightLine>> sights;  // with their node
    for (const PointSight& sight : point.sights) {
      const auto frame =
          std::ranges::find(frames, sight.frame_index, &TrajectoryEntry::frame_index);
      if (frame == frames.end()) continue;
      sights.emplace_back(NodeAt(frame->timestamp_s),
                          SightLine{frame->T_world_cam, sight.ray_cam, sight.sigma});
    }
    std::ranges::stable_sort(sights, {}, [](const auto& sight) { return sight.first; });
    for (std::size_t first = 0; first < sights.size();) {
      std::size_t last = first + 1;
      while (last < sights.size() && sights[last].first < sights[last - 1].first + kMinReturnGap) {
        ++last;
      }
      AddPassing(std::span(sights).subspan(first, last - first), point, S_metric_map);
      first = last;
    }
  }

  void AddPassing(std::span<const std::pair<std::size_t, SightLine>> sights,
                  const KnownPoint& point, const Similarity& S_metric_map) {
    constexpr double kLeastParallax_rad = 1.5 * std::numbers::pi / 180;
    constexpr double kFar = 5;  // standard deviations
    std::vector<SightLine> lines;
    for (const auto& [node, line] : sights) lines.push_back(line);
    const SightLineResult result = MeetSightLines(lines, kLeastParallax_rad, kFar);
    if (!result.meeting) return;
    const std::size_t node = sights[sights.size() / 2].first;
    const Eigen::Matrix3d R = S_metric_map.pose().rotation().toRotationMatrix();
    Eigen::Matrix3d covariance_m2 = S_metric_map.scale() * S_metric_map.scale() * R *
                                    result.meeting->covariance * R.transpose();
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kUnknown_m = 1e4;
      const double sigma_m = point.sigma_m[axis] > 0 ? point.sigma_m[axis] : kUnknown_m;
      covariance_m2(axis, axis) += sigma_m * sigma_m;
    }
    path_.positions.push_back({TimeOf(node), node,
                               map_.T_cam_world(keyframes_[node]) * result.meeting->p_world,
                               point.p_m, Eigen::Vector3d::Zero(), covariance_m2});
  }

  void AddPositions(std::span<const TrajectoryEntry> frames, const CameraPositions& positions) {
    const std::vector<TimedPoint> centres = CentresOf(frames);
    if (centres.size() < 2) return;
    std::size_t node = 0;
    for (const CameraPosition& position : positions.positions) {
      const std::optional<double> time_s = TimeOf(frames, position);
      if (!time_s || *time_s < centres.front().time_s || *time_s > centres.back().time_s) continue;
      const PathPoint centre = PointOnPath(centres, *time_s);
      // Names may be in another order than times.
      if (position.frame_index >= 0) node = NodeAt(*time_s);
      while (node + 1 < keyframes_.size() &&
             std::abs(TimeOf(node + 1) - *time_s) <= std::abs(TimeOf(node) - *time_s)) {
        ++node;
      }
      const Pose T_kf_world = map_.T_cam_world(keyframes_[node]);
      path_.positions.push_back({*time_s, node, T_kf_world * centre.p, position.p_m,
                                 T_kf_world.rotation() * centre.velocity});
    }
  }

  const Map& map_;
  std::vector<KeyframeId> keyframes_;  // of each node
  std::vector<std::optional<std::size_t>> node_of_;
  PositionedPath path_;
};

// Root of the mean square of what the keyframes have moved by, beyond a similarity of all.
double RmsMoved(const std::vector<Similarity>& before, const std::vector<Similarity>& after) {
  std::vector<Eigen::Vector3d> p_before, p_after;
  for (std::size_t i = 0; i < before.size(); ++i) {
    p_before.push_back(before[i].pose().translation());
    p_after.push_back(after[i].pose().translation());
  }
  const Similarity moved = FitSimilarity(p_before, p_after);
  double sum = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    sum += (moved * p_before[i] - p_after[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(before.size()));
}

// Takes the poses over into the map: the world becomes that in which the first node stays. Returns
// S_metric_map.
Similarity MoveMap(const PathOfMap& of_map, Map& map) {
  std::vector<KeyframeId> keyframes;  // that are still there
  std::vector<Similarity> S_metric_kf;
  std::size_t num_moved = 0;
  const std::size_t num_settled =
      of_map.keyframes.size() - std::min(of_map.num_open, of_map.keyframes.size() - 1);
  for (std::size_t i = 0; i < of_map.keyframes.size(); ++i) {
    if (i > 0 && !map.keyframe(of_map.keyframes[i]).alive) continue;
    keyframes.push_back(of_map.keyframes[i]);
    S_metric_kf.push_back(of_map.path.S_metric_kf[i]);
    if (i < num_settled) num_moved = keyframes.size();
  }
  const Similarity S_world_metric =
      Similarity(1, map.T_cam_world(keyframes.front()).Inverse()) * S_metric_kf.front().Inverse();
  std::vector<std::pair<KeyframeId, Similarity>> S_cam_world;
  for (std::size_t i = 0; i < num_moved; ++i) {
    S_cam_world.emplace_back(keyframes[i], (S_world_metric * S_metric_kf[i]).Inverse());
  }
  // The others, and those that came meanwhile, keep their poses relative to it.
  const auto [leader, S_leader_world] = S_cam_world.back();
  std::vector<KeyframeId> led(keyframes.begin() + static_cast<std::ptrdiff_t>(num_moved),
                              keyframes.end());
  for (KeyframeId id = of_map.num_keyframes; id < map.keyframes().size(); ++id) {
    if (map.keyframe(id).alive) led.push_back(id);
  }
  for (const KeyframeId id : led) {
    const Pose T_led_leader = map.T_cam_world(id) * map.T_cam_world(leader).Inverse();
    S_cam_world.emplace_back(id, Similarity(1, T_led_leader) * S_leader_world);
  }
  std::ranges::sort(S_cam_world, {}, [](const auto& moved) { return moved.first; });
  std::vector<KeyframeId> ids;
  std::vector<Similarity> poses;
  for (const auto& [id, S] : S_cam_world) {
    MapKeyframe& keyframe = map.keyframe(id);
    keyframe.S_world_visual =
        S.Inverse() * Similarity(1, keyframe.view.T_cam_world) * keyframe.S_world_visual;
    ids.push_back(id);
    poses.push_back(S);
  }
  map.Correct(ids, poses);
  return S_world_metric.Inverse();
}

}  // namespace

std::optional<PathOfMap> FindPath(const Map& map, std::span<const TrajectoryEntry> frames,
                                  std::size_t num_open, const CameraPositions& positions) {
  constexpr std::size_t kFewest = 3;
  MapPath found(map, frames, positions);
  PositionedPath& path = found.path();
  if (path.S_metric_kf.size() < kFewest || path.positions.size() < kFewest) return std::nullopt;
  PathOfMap of_map{found.keyframes(),
                   map.keyframes().size(),
                   num_open,
                   path.S_metric_kf,
                   StretchesOf(map, found.keyframes()),
                   {}};
  of_map.path = std::move(path);
  return of_map;
}

PathFit FitPath(PathOfMap& of_map) {
  of_map.path.drift = ImageDrift(of_map.stretches).value_or(of_map.path.drift);
  return FitPath(of_map.path);
}

PositionFit MoveOntoPath(const PathOfMap& of_map, const PathFit& fit, Map& map,
                         CameraPositions& positions) {
  const PositionedPath& path = of_map.path;
  positions.S_metric_map = MoveMap(of_map, map);
  PositionFit result;
  result.map_id = map.id();
  for (std::size_t i = 0; i < path.positions.size(); ++i) {
    const bool is_outlier = fit.is_outlier[i] != 0;
    if (path.positions[i].covariance_m2) {
      ++(is_outlier ? result.num_point_outliers : result.num_points_used);
    } else {
      ++(is_outlier ? result.num_outliers : result.num_used);
    }
  }
  result.horizontal = fit.noise.horizontal;
  if (path.has_vertical) result.vertical = fit.noise.vertical;
  result.drift = fit.noise.drift;
  result.rms_moved_m = RmsMoved(of_map.S_metric_kf, path.S_metric_kf);
  return result;
}

std::optional<PositionFit> FollowPositions(Map& map, std::span<const TrajectoryEntry> frames,
                                           std::size_t num_open, CameraPositions& positions,
                                           MappingLock& lock) {
  std::optional<PathOfMap> of_map = FindPath(map, frames, num_open, positions);
  if (!of_map) return std::nullopt;
  PathFit fit;
  {
    const ScopedUnlock away(lock);
    fit = FitPath(*of_map);
  }
  if (!fit.is_found) return std::nullopt;
  return MoveOntoPath(*of_map, fit, map, positions);
}

}  // namespace mono3d::tracking
