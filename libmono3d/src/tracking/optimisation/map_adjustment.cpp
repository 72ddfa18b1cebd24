// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/map_adjustment.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/map/depth_uncertainty.h"
#include "tracking/map/point_set.h"
#include "tracking/optimisation/bundle_adjustment.h"
#include "tracking/optimisation/map_constraints.h"
#include "tracking/optimisation/path_uncertainty.h"
#include "tracking/optimisation/scale_gauge.h"

namespace mono3d::tracking {
namespace {

// The next keyframe adjusts nearly the same again: what a further step would gain comes with it.
constexpr double kLocalMinGain = 1e-3;

// A bundle adjustment and where its parts come from.
struct MapAdjustment {
  BundleAdjustmentProblem problem;
  std::vector<KeyframeId> keyframes;      // of each view
  std::vector<PointId> points;            // of each point
  std::vector<Observation> observations;  // of each observation
  KeyframeId num_keyframes = 0;           // in the map at that time
};

// Depths that the images say next to nothing about stay about where they are: without it they would
// run off to infinity. None where they say more: the guesses of many points would hold the scale.
void AddDepthPrior(const Map& map, const MapPoint& point, std::size_t index,
                   BundleAdjustmentProblem& problem) {
  constexpr double kVague = 0.3;  // of the inverse depth
  if (point.depth_sigma < kVague) return;
  const Eigen::Vector3d centre = MeanCentre(map, point);
  const double inverse = 1 / (point.p_world - centre).norm();
  problem.depth_priors.push_back({index, centre, inverse, kGuessedDepthSigma * inverse});
}

// The points that `adjusted` see, as seen by them and by `fixed`.
MapAdjustment Collect(const Map& map, const std::vector<KeyframeId>& adjusted,
                      const std::vector<KeyframeId>& fixed) {
  MapAdjustment adjustment;
  adjustment.problem.camera = map.camera();
  adjustment.num_keyframes = map.keyframes().size();
  std::vector<std::optional<std::size_t>> view_of(map.keyframes().size());
  const auto add_view = [&](KeyframeId id, bool is_fixed) {
    view_of[id] = adjustment.keyframes.size();
    adjustment.keyframes.push_back(id);
    adjustment.problem.T_cam_world.push_back(map.keyframe(id).view.T_cam_world);
    adjustment.problem.is_fixed.push_back(is_fixed ? 1 : 0);
  };
  for (const KeyframeId id : adjusted) add_view(id, false);
  for (const KeyframeId id : fixed) add_view(id, true);
  PointSet listed(map);
  for (const KeyframeId id : adjusted) {
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || !listed.Insert(*point)) continue;
      const std::size_t index = adjustment.points.size();
      adjustment.points.push_back(*point);
      adjustment.problem.p_world.push_back(map.point(*point).p_world);
      AddDepthPrior(map, map.point(*point), index, adjustment.problem);
      for (const Observation& observation : map.point(*point).observations) {
        const std::optional<std::size_t> view = view_of[observation.keyframe];
        if (!view) continue;
        const View& shown = map.keyframe(observation.keyframe).view;
        const Feature& feature = shown.features[observation.feature];
        // By the poses as they are: while they move by a few px, how far the scene moves during
        // the readout stays as it is to a hundredth of a pixel.
        const Eigen::Vector2d pixel =
            map.AtMiddleLine(shown, feature.pixel, map.point(*point).p_world);
        adjustment.problem.observations.push_back({*view, index, pixel, feature.sigma_px});
        adjustment.observations.push_back(observation);
      }
    }
  }
  adjustment.problem.constraints = ConstraintsOf(map, view_of);
  return adjustment;
}

// All there is; the first keyframe stays, and so does the scale.
MapAdjustment CollectAll(const Map& map) {
  std::vector<KeyframeId> adjusted;
  std::vector<KeyframeId> fixed;
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    if (map.keyframe(id).alive) (fixed.empty() ? fixed : adjusted).push_back(id);
  }
  MapAdjustment adjustment = Collect(map, adjusted, fixed);
  if (fixed.empty()) return adjustment;
  if (const std::optional<KeyframeId> held = FindScaleKeyframe(map, fixed.front())) {
    const auto view_of = [&](KeyframeId id) {
      return static_cast<std::size_t>(
          std::find(adjustment.keyframes.begin(), adjustment.keyframes.end(), id) -
          adjustment.keyframes.begin());
    };
    adjustment.problem.constraints.push_back(
        HoldDistance(adjustment.problem, view_of(*held), view_of(fixed.front())));
  }
  return adjustment;
}

// Keyframes that came while the adjustment was at work, placed by the map as it was before, move
// with the newest one that was in it.
void MoveNewer(const MapAdjustment& adjustment, Map& map) {
  std::optional<std::size_t> newest;
  for (std::size_t i = 0; i < adjustment.keyframes.size(); ++i) {
    if (adjustment.problem.is_fixed[i] != 0) continue;
    if (!newest || adjustment.keyframes[i] > adjustment.keyframes[*newest]) newest = i;
  }
  if (!newest) return;
  const Pose T_world_new = map.T_cam_world(adjustment.keyframes[*newest]).Inverse() *
                           adjustment.problem.T_cam_world[*newest];
  for (KeyframeId id = adjustment.num_keyframes; id < map.keyframes().size(); ++id) {
    Pose& T_cam_world = map.keyframe(id).view.T_cam_world;
    T_cam_world = T_cam_world * T_world_new;
  }
}

// Takes the result over into the map.
void Apply(const MapAdjustment& adjustment, const BundleAdjustmentReport& report, Map& map) {
  MoveNewer(adjustment, map);
  for (std::size_t i = 0; i < adjustment.keyframes.size(); ++i) {
    if (adjustment.problem.is_fixed[i] != 0) continue;
    map.keyframe(adjustment.keyframes[i]).view.T_cam_world = adjustment.problem.T_cam_world[i];
  }
  for (std::size_t i = 0; i < adjustment.points.size(); ++i) {
    map.point(adjustment.points[i]).p_world = adjustment.problem.p_world[i];
  }
  for (std::size_t i = 0; i < adjustment.observations.size(); ++i) {
    const PointId point = adjustment.points[adjustment.problem.observations[i].point];
    if (report.is_outlier[i] == 0 || !map.IsAlive(point)) continue;
    map.RemoveObservation(point, adjustment.observations[i]);
  }
  for (const PointId point : adjustment.points) {
    if (map.IsAlive(point)) map.UpdateGeometry(point);
  }
}

// The problem is a copy of the part of the map: meanwhile others may have that.
BundleAdjustmentReport AdjustCopy(MapAdjustment& adjustment, BundleAdjustmentOptions options,
                                  MappingLock& lock) {
  options.stop = lock.is_interrupted();
  const ScopedUnlock away(lock);
  return SolveBundleAdjustment(adjustment.problem, options);
}

// Every keyframe that moved together with two newer ones comes closer to being finalised.
void CountNewer(std::vector<KeyframeId> adjusted, Map& map) {
  std::sort(adjusted.begin(), adjusted.end());
  for (std::size_t i = 0; i < adjusted.size(); ++i) {
    int& count = map.keyframe(adjusted[i]).num_newer_adjusted;
    count = std::max(count, static_cast<int>(adjusted.size() - 1 - i));
  }
}

// z of the point of each feature, 0 where there is none, of each keyframe.
std::vector<std::vector<double>> DepthsByFeature(const Map& map) {
  std::vector<std::vector<double>> depths;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    std::vector<double>& of_keyframe = depths.emplace_back();
    for (const std::optional<PointId>& point : keyframe.view.points) {
      of_keyframe.push_back(point ? (keyframe.view.T_cam_world * map.point(*point).p_world).z()
                                  : 0);
    }
  }
  return depths;
}

// The adjustment has changed the scale around the keyframes as well: by the median over the points.
void NoteScales(const std::vector<std::vector<double>>& before, Map& map) {
  const std::vector<std::vector<double>> after = DepthsByFeature(map);
  std::vector<double> ratios(map.keyframes().size(), 1);
  for (KeyframeId id = 0; id < before.size(); ++id) {  // later ones were not in it
    if (!map.keyframe(id).alive) continue;
    std::vector<float> of_points;
    for (std::size_t i = 0; i < after[id].size(); ++i) {
      if (before[id][i] > 0 && after[id][i] > 0) {
        of_points.push_back(static_cast<float>(after[id][i] / before[id][i]));
      }
    }
    if (!of_points.empty()) ratios[id] = UpperMedianOrZero(std::move(of_points));
  }
  map.ScaleAround(ratios);
}

// Further views of the points, which move with the problem.
void AddViews(const Map& map, const std::vector<View>& views, MapAdjustment& adjustment) {
  if (views.empty()) return;
  std::vector<std::optional<std::size_t>> index_of(map.points().size());
  for (std::size_t i = 0; i < adjustment.points.size(); ++i) {
    index_of[adjustment.points[i].index] = i;
  }
  BundleAdjustmentProblem& problem = adjustment.problem;
  for (const View& view : views) {
    const std::size_t number = problem.T_cam_world.size();
    problem.T_cam_world.push_back(view.T_cam_world);
    problem.is_fixed.push_back(0);
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      if (!view.points[i] || !map.IsAlive(*view.points[i])) continue;
      const std::optional<std::size_t> point = index_of[view.points[i]->index];
      if (!point) continue;
      const Feature& feature = view.features[i];
      const Eigen::Vector2d pixel =
          map.AtMiddleLine(view, feature.pixel, map.point(*view.points[i]).p_world);
      problem.observations.push_back({number, *point, pixel, feature.sigma_px});
    }
  }
}

// All there is, and further views, whose poses follow.
bool AdjustAllWith(Map& map, std::vector<View>& views, MappingLock& lock) {
  // A start is further off than a local map, and a loop converges slowly.
  constexpr int kSteps = 20;
  constexpr double kMinGain = 1e-6;
  MapAdjustment adjustment = CollectAll(map);
  AddViews(map, views, adjustment);
  const std::vector<Eigen::Vector3d> before = adjustment.problem.p_world;
  const BundleAdjustmentReport report = AdjustCopy(adjustment, {kSteps, kSteps, kMinGain}, lock);
  RestoreDepths(before, adjustment.problem);
  Apply(adjustment, report, map);
  map.ForgetPositions();
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].T_cam_world = adjustment.problem.T_cam_world[adjustment.keyframes.size() + i];
  }
  return lock.is_interrupted() == nullptr || !*lock.is_interrupted();
}

// Of the keyframes around `first_after`: more before it say nothing of what comes after, and cost.
ScaleAcross ScaleOf(const Map& map, KeyframeId first_after, const std::vector<View>& views) {
  constexpr KeyframeId kNumBefore = 20;
  std::vector<KeyframeId> around;
  for (KeyframeId id = first_after - std::min(first_after, kNumBefore); id < map.keyframes().size();
       ++id) {
    if (map.keyframe(id).alive) around.push_back(id);
  }
  MapAdjustment adjustment = Collect(map, around, {});
  AddViews(map, views, adjustment);
  std::vector<std::size_t> before;
  std::vector<std::size_t> after;
  for (std::size_t i = 0; i < around.size(); ++i) {
    (around[i] < first_after ? before : after).push_back(i);
  }
  const std::vector<Pose>& poses = adjustment.problem.T_cam_world;
  return {std::log(PathSize(poses, after) / PathSize(poses, before)),
          RelativePathSigma(adjustment.problem, before, after).log_scale};
}

}  // namespace

void AdjustLocally(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                   MappingLock& lock) {
  std::vector<KeyframeId> adjusted = {keyframe};
  for (const Covisible& neighbour : map.CovisibleKeyframes(keyframe)) {
    if (static_cast<int>(adjusted.size()) >= options.num_adjusted_keyframes) break;
    adjusted.push_back(neighbour.keyframe);
  }
  std::vector<std::optional<PointId>> points;
  std::vector<char> is_adjusted(map.keyframes().size(), 0);
  PointSet listed(map);
  for (const KeyframeId id : adjusted) {
    is_adjusted[id] = 1;
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || !listed.Insert(*point)) continue;
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
  MapAdjustment adjustment = Collect(map, adjusted, fixed);
  const std::vector<Pose> before = adjustment.problem.T_cam_world;
  const BundleAdjustmentReport report = AdjustCopy(adjustment, {.min_gain = kLocalMinGain}, lock);
  if (fixed.size() == 1) RestoreDistances(before, adjustment.problem);
  Apply(adjustment, report, map);
  CountNewer(together, map);
}

void AdjustAll(Map& map) {
  MappingLock alone;
  AdjustAll(map, alone);
}

bool AdjustAll(Map& map, MappingLock& lock) {
  std::vector<View> none;
  return AdjustAllWith(map, none, lock);
}

std::optional<ScaleAcross> AdjustAcross(Map& map, KeyframeId first_after,
                                        const std::vector<View>& views, MappingLock& lock) {
  // Where little but the hover tells the scale, a step changes the cost by next to nothing, and the
  // scale by a part of its standard deviation.
  constexpr int kMaxRounds = 20;
  constexpr double kSettled = 0.02;  // of the standard deviation, by one round
  std::vector<View> moved = views;
  ScaleAcross scale = ScaleOf(map, first_after, moved);
  const std::vector<std::vector<double>> before = DepthsByFeature(map);
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!AdjustAllWith(map, moved, lock)) return std::nullopt;
    const double log_ratio_before = scale.log_ratio;
    scale = ScaleOf(map, first_after, moved);
    if (std::abs(scale.log_ratio - log_ratio_before) < kSettled * scale.sigma) break;
  }
  NoteScales(before, map);
  return scale;
}

void RemoveOutliers(Map& map) {
  MapAdjustment adjustment = CollectAll(map);
  const BundleAdjustmentReport report = SolveBundleAdjustment(adjustment.problem, {0, 0});
  Apply(adjustment, report, map);
}

bool AdjustAllAndScales(Map& map, MappingLock& lock) {
  const std::vector<std::vector<double>> before = DepthsByFeature(map);
  const bool is_done = AdjustAll(map, lock);
  NoteScales(before, map);
  return is_done;
}

}  // namespace mono3d::tracking
