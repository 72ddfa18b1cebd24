// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/local_mapping.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "tracking/bundle_adjustment.h"
#include "tracking/direct_tracking.h"
#include "tracking/keyframe_constraints.h"
#include "tracking/point_creation.h"
#include "tracking/point_culling.h"
#include "tracking/scale_gauge.h"

namespace mono3d::tracking {
namespace {

// Keyframes after this many newer ones in their bundle adjustments are final.
constexpr int kMinNewer = 2;

// The next keyframe adjusts nearly the same again: what a further step would gain comes with it.
constexpr double kLocalMinGain = 1e-3;

// A bundle problem and where its parts come from.
struct MapBundle {
  BundleProblem problem;
  std::vector<KeyframeId> keyframes;      // of each view
  std::vector<PointId> points;            // of each point
  std::vector<Observation> observations;  // of each observation
  KeyframeId num_keyframes = 0;           // in the map at that time
};

// The points that `adjusted` see, as seen by them and by `fixed`.
MapBundle Collect(const Map& map, const std::vector<KeyframeId>& adjusted,
                  const std::vector<KeyframeId>& fixed) {
  MapBundle bundle;
  bundle.problem.camera = map.camera();
  bundle.num_keyframes = map.keyframes().size();
  std::vector<std::optional<std::size_t>> view_of(map.keyframes().size());
  const auto add_view = [&](KeyframeId id, bool is_fixed) {
    view_of[id] = bundle.keyframes.size();
    bundle.keyframes.push_back(id);
    bundle.problem.T_cam_world.push_back(map.keyframe(id).view.T_cam_world);
    bundle.problem.is_fixed.push_back(is_fixed ? 1 : 0);
  };
  for (const KeyframeId id : adjusted) add_view(id, false);
  for (const KeyframeId id : fixed) add_view(id, true);
  std::vector<char> is_listed(map.points().size(), 0);
  for (const KeyframeId id : adjusted) {
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || is_listed[*point] != 0) continue;
      is_listed[*point] = 1;
      const std::size_t index = bundle.points.size();
      bundle.points.push_back(*point);
      bundle.problem.p_world.push_back(map.point(*point).p_world);
      for (const Observation& observation : map.point(*point).observations) {
        const std::optional<std::size_t> view = view_of[observation.keyframe];
        if (!view) continue;
        const Feature& feature =
            map.keyframe(observation.keyframe).view.features[observation.feature];
        bundle.problem.observations.push_back({*view, index, feature.pixel, feature.sigma_px});
        bundle.observations.push_back(observation);
      }
    }
  }
  bundle.problem.constraints = ConstraintsOf(map, view_of);
  return bundle;
}

// All there is; the first keyframe stays, and so does the scale.
MapBundle CollectAll(const Map& map) {
  std::vector<KeyframeId> adjusted;
  std::vector<KeyframeId> fixed;
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    if (map.keyframe(id).alive) (fixed.empty() ? fixed : adjusted).push_back(id);
  }
  MapBundle bundle = Collect(map, adjusted, fixed);
  if (fixed.empty()) return bundle;
  if (const std::optional<KeyframeId> held = FindScaleKeyframe(map, fixed.front())) {
    const auto view_of = [&](KeyframeId id) {
      return static_cast<std::size_t>(
          std::find(bundle.keyframes.begin(), bundle.keyframes.end(), id) -
          bundle.keyframes.begin());
    };
    bundle.problem.constraints.push_back(
        HoldDistance(bundle.problem, view_of(*held), view_of(fixed.front())));
  }
  return bundle;
}

// Keyframes that came while the adjustment was at work, placed by the map as it was before, move
// with the newest one that was in it.
void MoveNewer(const MapBundle& bundle, Map& map) {
  std::optional<std::size_t> newest;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (bundle.problem.is_fixed[i] != 0) continue;
    if (!newest || bundle.keyframes[i] > bundle.keyframes[*newest]) newest = i;
  }
  if (!newest) return;
  const Pose T_world_new =
      map.T_cam_world(bundle.keyframes[*newest]).Inverse() * bundle.problem.T_cam_world[*newest];
  for (KeyframeId id = bundle.num_keyframes; id < map.keyframes().size(); ++id) {
    Pose& T_cam_world = map.keyframe(id).view.T_cam_world;
    T_cam_world = T_cam_world * T_world_new;
  }
}

// Takes the result over into the map.
void Apply(const MapBundle& bundle, const BundleReport& report, Map& map) {
  MoveNewer(bundle, map);
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (bundle.problem.is_fixed[i] != 0) continue;
    map.keyframe(bundle.keyframes[i]).view.T_cam_world = bundle.problem.T_cam_world[i];
  }
  for (std::size_t i = 0; i < bundle.points.size(); ++i) {
    map.point(bundle.points[i]).p_world = bundle.problem.p_world[i];
  }
  for (std::size_t i = 0; i < bundle.observations.size(); ++i) {
    const PointId point = bundle.points[bundle.problem.observations[i].point];
    if (report.is_outlier[i] == 0 || !map.point(point).alive) continue;
    map.RemoveObservation(point, bundle.observations[i]);
  }
  for (const PointId point : bundle.points) {
    if (map.point(point).alive) map.UpdateGeometry(point);
  }
}

// The problem is a copy of the part of the map: meanwhile others may have that.
BundleReport AdjustCopy(MapBundle& bundle, BundleOptions options, MappingTurn& turn) {
  options.stop = turn.is_interrupted();
  const WithoutMap away(turn);
  return AdjustBundle(bundle.problem, options);
}

// Every keyframe that moved together with two newer ones comes closer to being finalised.
void CountNewer(std::vector<KeyframeId> adjusted, Map& map) {
  std::sort(adjusted.begin(), adjusted.end());
  for (std::size_t i = 0; i < adjusted.size(); ++i) {
    int& count = map.keyframe(adjusted[i]).num_newer_adjusted;
    count = std::max(count, static_cast<int>(adjusted.size() - 1 - i));
  }
}

// Do three others have as fine a look at the point of a feature as its keyframe, or finer?
bool IsSeenByOthers(const Map& map, KeyframeId id, std::size_t feature) {
  const View& view = map.keyframe(id).view;
  int num_others = 0;
  for (const Observation& observation : map.point(*view.points[feature]).observations) {
    if (observation.keyframe == id) continue;
    const View& other = map.keyframe(observation.keyframe).view;
    const int level = other.features[observation.feature].level;
    num_others += level <= view.features[feature].level + 1 ? 1 : 0;
    if (num_others >= 3) return true;
  }
  return false;
}

bool IsRedundant(const Map& map, KeyframeId id, double max_share) {
  const View& view = map.keyframe(id).view;
  const auto num_points = static_cast<double>(std::count_if(
      view.points.begin(), view.points.end(), [](const auto& point) { return point.has_value(); }));
  // Most keyframes are out of the question after a few points.
  int num_missed = 0;
  for (std::size_t feature = 0; feature < view.points.size(); ++feature) {
    if (!view.points[feature] || IsSeenByOthers(map, id, feature)) continue;
    ++num_missed;
    if (num_points - num_missed <= max_share * num_points) return false;
  }
  return num_points > 0;
}

// The keyframe of a lower number that shares most with one, else the next lower one.
KeyframeId AnchorOf(const Map& map, KeyframeId id) {
  for (const Covisible& other : map.CovisibleKeyframes(id)) {
    if (other.keyframe < id) return other.keyframe;
  }
  KeyframeId anchor = id - 1;
  while (!map.keyframe(anchor).alive) --anchor;
  return anchor;
}

Keyframe ToKeyframe(const Map& map, const MapKeyframe& from) {
  Keyframe keyframe;
  keyframe.id = from.id;
  keyframe.frame = from.view.frame;
  keyframe.sparse_depths_su = map.Depths(from.view);
  for (float& depth : keyframe.sparse_depths_su) depth /= static_cast<float>(from.scale);
  return keyframe;
}

}  // namespace

void MapKeyframeInto(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                     StageTimes* times, MappingTurn& turn) {
  {
    const ScopedStageTimer timer(times, "tracking/point_creation");
    map.ReuseReleased();
    CullPoints(map);
    LearnSlopes(map, keyframe);
    RenewPatches(map, keyframe);
    constexpr std::size_t kFewPoints = 100;  // with the images before
    const bool is_far = map.Depths(map.keyframe(keyframe).view).size() < kFewPoints;
    CreatePoints(map, keyframe, options);
    if (is_far) CreatePointsByPatches(map, keyframe, options);
    turn.Breathe();
    FusePoints(map, keyframe, options);
    CountShown(map, keyframe);
  }
  {
    const ScopedStageTimer timer(times, "tracking/local_bundle_adjustment");
    AdjustLocally(map, keyframe, options, turn);
  }
  turn.Breathe();
  const ScopedStageTimer timer(times, "tracking/keyframe_culling");
  CullKeyframes(map, keyframe, options);
  // Images are for new points and patches, which only the newest keyframes get.
  constexpr KeyframeId kNumWithImages = 20;
  if (keyframe >= kNumWithImages) map.keyframe(keyframe - kNumWithImages).view.octaves = {};
}

void RenewPatches(Map& map, KeyframeId keyframe) {
  const View& view = map.keyframe(keyframe).view;
  const Eigen::Vector3d centre = view.Centre();
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i]) continue;
    const MapPoint& point = map.point(*view.points[i]);
    if (point.patch && LooksAlike(map, point, point.patch_keyframe, centre)) continue;
    TakePatchOf(map, *view.points[i], keyframe, view.features[i]);
  }
}

void AdjustLocally(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                   MappingTurn& turn) {
  std::vector<KeyframeId> adjusted = {keyframe};
  for (const Covisible& neighbour : map.CovisibleKeyframes(keyframe)) {
    if (static_cast<int>(adjusted.size()) >= options.num_adjusted_keyframes) break;
    adjusted.push_back(neighbour.keyframe);
  }
  std::vector<std::optional<PointId>> points;
  std::vector<char> is_adjusted(map.keyframes().size(), 0);
  std::vector<char> is_listed(map.points().size(), 0);
  for (const KeyframeId id : adjusted) {
    is_adjusted[id] = 1;
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || is_listed[*point] != 0) continue;
      is_listed[*point] = 1;
      points.push_back(point);
    }
  }
  std::vector<KeyframeId> fixed;
  for (const Covisible& seeing : map.KeyframesSeeing(points)) {
    if (static_cast<int>(fixed.size()) >= options.num_fixed_keyframes) break;
    if (is_adjusted[seeing.keyframe] == 0) fixed.push_back(seeing.keyframe);
  }
  // Position and attitude must be held by something: the oldest, where all would move. Not by two:
  // how they lie to each other is what a young map knows least.
  std::sort(adjusted.begin(), adjusted.end());
  const std::vector<KeyframeId> together = adjusted;
  if (fixed.empty() && adjusted.size() > 1) {
    fixed.push_back(adjusted.front());
    adjusted.erase(adjusted.begin());
  }
  MapBundle bundle = Collect(map, adjusted, fixed);
  const std::vector<Pose> before = bundle.problem.T_cam_world;
  const BundleReport report = AdjustCopy(bundle, {.min_gain = kLocalMinGain}, turn);
  if (fixed.size() == 1) RestoreDistances(before, bundle.problem);
  Apply(bundle, report, map);
  CountNewer(together, map);
}

void AdjustAll(Map& map) {
  MappingTurn alone;
  AdjustAll(map, alone);
}

bool AdjustAll(Map& map, MappingTurn& turn) {
  // A start is further off than a local map, and a loop settles slowly.
  constexpr int kSteps = 20;
  constexpr double kMinGain = 1e-6;
  MapBundle bundle = CollectAll(map);
  const std::vector<Eigen::Vector3d> before = bundle.problem.p_world;
  const BundleReport report = AdjustCopy(bundle, {kSteps, kSteps, kMinGain}, turn);
  RestoreDepths(before, bundle.problem);
  Apply(bundle, report, map);
  return turn.is_interrupted() == nullptr || !*turn.is_interrupted();
}

void RemoveOutliers(Map& map) {
  MapBundle bundle = CollectAll(map);
  const BundleReport report = AdjustBundle(bundle.problem, {0, 0});
  Apply(bundle, report, map);
}

void CullKeyframes(Map& map, KeyframeId keyframe, const LocalMappingOptions& options) {
  for (const Covisible& neighbour : map.CovisibleKeyframes(keyframe)) {
    // The first one defines the world; those that have not finalised are still awaited.
    if (neighbour.keyframe == 0 || !map.keyframe(neighbour.keyframe).is_finalised) continue;
    if (!IsRedundant(map, neighbour.keyframe, options.max_redundant_share)) continue;
    map.RemoveKeyframe(neighbour.keyframe, AnchorOf(map, neighbour.keyframe));
  }
}

std::vector<KeyframeId> InOrderOfFlight(const Map& map) {
  std::vector<KeyframeId> ids(map.keyframes().size());
  std::iota(ids.begin(), ids.end(), KeyframeId{0});
  std::stable_sort(ids.begin(), ids.end(), [&](KeyframeId a, KeyframeId b) {
    return map.keyframe(a).view.frame.index < map.keyframe(b).view.frame.index;
  });
  return ids;
}

std::vector<Keyframe> TakeFinalised(Map& map, bool all) {
  // One that has lost sight of the newer ones settles by age.
  constexpr KeyframeId kMaxAge = 8;
  std::vector<Keyframe> finalised;
  for (const KeyframeId id : InOrderOfFlight(map)) {
    MapKeyframe& keyframe = map.keyframe(id);
    if (keyframe.is_finalised) continue;
    const bool is_old = id + kMaxAge < map.keyframes().size();
    if (!all && !is_old && keyframe.num_newer_adjusted < kMinNewer) break;
    finalised.push_back(ToKeyframe(map, keyframe));
    keyframe.is_finalised = true;
    keyframe.view.frame.bgr.release();
  }
  return finalised;
}

void MarkAdjusted(Map& map, KeyframeId keyframe) {
  int& count = map.keyframe(keyframe).num_newer_adjusted;
  count = std::max(count, kMinNewer);
}

}  // namespace mono3d::tracking
