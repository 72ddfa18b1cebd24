// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/world_continuation.h"

#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "mono3d/pipeline/world_axes.h"

namespace mono3d {
namespace {

struct PosePair {
  Pose T_old_cam;
  Pose T_new_cam;
};

// Root mean square distance from the mean.
double Spread(const std::vector<PosePair>& pairs, Pose PosePair::*side) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) mean += (pair.*side).translation();
  mean /= static_cast<double>(pairs.size());
  double sum = 0;
  for (const PosePair& pair : pairs) sum += ((pair.*side).translation() - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(pairs.size()));
}

// Besides its centre each camera has three points on its axes, as far away as the centres are
// spread: on a straight flight the centres alone leave a rotation free.
std::optional<Similarity> LayUpon(const std::vector<PosePair>& pairs) {
  if (pairs.size() < 3) return std::nullopt;
  const double old_spread = Spread(pairs, &PosePair::T_old_cam);
  const double new_spread = Spread(pairs, &PosePair::T_new_cam);
  if (!(old_spread > 0 && new_spread > 0)) return std::nullopt;
  std::vector<Eigen::Vector3d> old_points;
  std::vector<Eigen::Vector3d> new_points;
  for (const PosePair& pair : pairs) {
    for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                                             Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
      old_points.push_back(pair.T_old_cam * Eigen::Vector3d(old_spread * direction));
      new_points.push_back(pair.T_new_cam * Eigen::Vector3d(new_spread * direction));
    }
  }
  return FitSimilarity(new_points, old_points);
}

}  // namespace

WorldContinuation::WorldContinuation(const std::vector<TrajectoryEntry>& old_run,
                                     const std::vector<TrajectoryEntry>& new_run,
                                     std::uint64_t last_version)
    : last_version_(last_version) {
  std::map<std::int64_t, const TrajectoryEntry*> old_frames;
  for (const TrajectoryEntry& entry : old_run) old_frames[entry.frame_index] = &entry;
  std::map<std::pair<int, int>, std::vector<PosePair>> common;  // by map of the new and the old run
  for (const TrajectoryEntry& entry : new_run) {
    const auto found = old_frames.find(entry.frame_index);
    if (found == old_frames.end()) continue;
    common[{entry.map_id, found->second->map_id}].push_back(
        {found->second->T_world_cam, entry.T_world_cam});
  }
  std::map<int, std::size_t> num_common;
  for (const auto& [maps, pairs] : common) {
    const auto& [new_map, old_map] = maps;
    if (pairs.size() <= num_common[new_map]) continue;
    const std::optional<Similarity> S_old_new = LayUpon(pairs);
    if (!S_old_new) continue;
    num_common[new_map] = pairs.size();
    maps_[new_map] = {old_map, *S_old_new};
  }
}

Similarity WorldContinuation::Of(int map_id) const {
  const auto found = maps_.find(map_id);
  return found == maps_.end() ? Similarity() : found->second.S_old_new;
}

int WorldContinuation::OldMapOf(int map_id) const {
  const auto found = maps_.find(map_id);
  return found == maps_.end() ? -1 : found->second.old_map;
}

KeyframePosesPtr WorldContinuation::Moved(const KeyframePosesPtr& poses) const {
  if (!poses || IsIdentity()) return poses;
  std::vector<KeyframePose> moved(poses->poses().begin(), poses->poses().end());
  for (KeyframePose& pose : moved) pose.S_world_kf = Of(pose.map_id) * pose.S_world_kf;
  return std::make_shared<KeyframePoses>(poses->version() + last_version_, std::move(moved));
}

std::shared_ptr<const PlaceOfMap> WorldContinuation::Moved(
    std::shared_ptr<const PlaceOfMap> place) const {
  if (!place || IsIdentity()) return place;
  PlaceOfMap moved = *place;
  moved.georeference.S_enu_map = moved.georeference.S_enu_map * Of(moved.map_id).Inverse();
  return std::make_shared<const PlaceOfMap>(std::move(moved));
}

void WorldContinuation::Move(PipelineSnapshot& snapshot) const {
  if (IsIdentity()) return;
  if (snapshot.pose) {
    snapshot.pose->T_world_cam = Of(snapshot.pose->map_id) * snapshot.pose->T_world_cam;
  }
  snapshot.keyframe_poses = Moved(snapshot.keyframe_poses);
  snapshot.model_poses = Moved(snapshot.model_poses);
  for (SurfelAnchor& anchor : snapshot.surfels.anchors) {
    anchor.S_world_anchor = Of(snapshot.model_map_id) * anchor.S_world_anchor;
  }
  snapshot.place = Moved(std::move(snapshot.place));
}

void WorldContinuation::Move(Reconstruction& reconstruction) const {
  if (IsIdentity()) return;
  for (MapReconstruction& map : reconstruction.maps) {
    MoveWorld(Of(map.map_id), map);
  }
}

void WorldContinuation::ContinueOnline(const std::vector<TrajectoryEntry>& old_run,
                                       std::int64_t first_frame,
                                       Reconstruction& reconstruction) const {
  for (MapReconstruction& map : reconstruction.maps) {
    std::vector<TrajectoryEntry> online;
    for (TrajectoryEntry entry : old_run) {
      if (entry.map_id != OldMapOf(map.map_id)) continue;
      entry.map_id = map.map_id;
      online.push_back(entry);
    }
    for (const TrajectoryEntry& entry : map.online_trajectory) {
      if (entry.frame_index >= first_frame) online.push_back(entry);
    }
    map.online_trajectory = std::move(online);
  }
}

}  // namespace mono3d
