// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/patch_tracking.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tracking/alignment/image_alignment.h"
#include "tracking/alignment/image_cells.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/features/feature_grid.h"
#include "tracking/features/matching.h"
#include "tracking/map/point_set.h"

namespace mono3d::tracking {
namespace {

struct PatchCandidate {
  PointId point;
  Eigen::Vector2d pixel;
  int num_observations = 0;
  bool is_direction = false;
};

// The points of the keyframes that see what `near` sees.
std::vector<PointId> PointsAround(const Map& map, const View& near) {
  constexpr std::size_t kMaxKeyframes = 15;  // bounds the time of a frame
  std::vector<PointId> points;
  PointSet listed(map);
  const auto list = [&](const std::vector<std::optional<PointId>>& seen) {
    for (const std::optional<PointId>& point : seen) {
      if (point && map.IsAlive(*point) && listed.Insert(*point)) points.push_back(*point);
    }
  };
  list(near.points);
  const std::vector<Covisible> seeing = map.KeyframesSeeing(near.points);
  for (std::size_t i = 0; i < std::min(seeing.size(), kMaxKeyframes); ++i) {
    list(map.keyframe(seeing[i].keyframe).view.points);
  }
  return points;
}

std::vector<SeenPoint> SeenPoints(const Map& map, const View& previous) {
  std::vector<SeenPoint> seen;
  for (std::size_t i = 0; i < previous.points.size(); ++i) {
    const std::optional<PointId>& point = previous.points[i];
    if (!point || !map.IsAlive(*point)) continue;
    // Where its line saw it: the next image sees it from about the same line.
    const Eigen::Vector3d p_cam =
        previous.shutter.AtItsLine(previous.T_cam_world * map.point(*point).p_world);
    if (p_cam.z() > 0) seen.push_back({map.camera().Project(p_cam), p_cam});
  }
  return seen;
}

// The pose, and how well the patches were found: an image that is compressed, dark or blurred moves
// them by more than one of them tells, and most would be outliers.
PoseResult RefinePoseAndNoise(const Map& map, View& view) {
  // What is off by more than this, a fifth of a pixel and more, has another reason.
  constexpr double kMost = 3;
  // From one image to the next: what sets in at once is no noise but a part of the map that has
  // drifted from the rest, and comes into view.
  constexpr double kMostGrowth = 1.1;
  constexpr double kSettled = 0.05;  // changes the number of outliers by less than a hundredth
  constexpr int kMaxRounds = 3;
  const double most = view.patch_noise ? std::min(kMost, kMostGrowth * *view.patch_noise) : kMost;
  const std::vector<std::optional<PointId>> points = view.points;
  double noise = view.patch_noise.value_or(1);
  for (Feature& feature : view.features) feature.sigma_px *= noise;
  PoseResult result = RefinePose(map, view);
  for (int round = 1; round < kMaxRounds; ++round) {
    const double before = noise;
    noise = std::clamp(before * result.noise_scale, 1.0, most);
    if (std::abs(noise / before - 1) < kSettled) break;
    for (Feature& feature : view.features) feature.sigma_px *= noise / before;
    view.points = points;
    result = RefinePose(map, view);
  }
  view.patch_noise = noise;
  return result;
}

// One point for each cell of the image that shows some.
class CellCount {
 public:
  explicit CellCount(const CameraModel& camera) : cells_(camera), is_filled_(cells_.size(), 0) {}

  void Add(const Eigen::Vector2d& pixel) { is_filled_[cells_.Index(pixel)] = 1; }
  int num_filled() const { return static_cast<int>(std::ranges::count(is_filled_, 1)); }

 private:
  ImageCells cells_;
  std::vector<char> is_filled_;
};

}  // namespace

PoseResult TrackDirectly(Map& map, const View& previous, View& view) {
  const Pose T_view_previous = view.T_cam_world * previous.T_cam_world.Inverse();
  view.T_cam_world = AlignImages(map.camera(), previous.octaves, SeenPoints(map, previous),
                                 view.octaves, T_view_previous) *
                     previous.T_cam_world;
  return TrackPatches(map, previous, view);
}

int CountTrackable(const Map& map, const View& view) {
  CellCount cells(map.camera());
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i] || !map.camera().Contains(view.features[i].pixel)) continue;
    if (map.point(*view.points[i]).observations.size() < kMinConfirmedObservations) continue;
    cells.Add(view.features[i].pixel);
  }
  return cells.num_filled();
}

int CountTracked(const Map& map, const View& view) {
  CellCount cells(map.camera());
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (view.points[i] && map.camera().Contains(view.features[i].pixel)) {
      cells.Add(view.features[i].pixel);
    }
  }
  return cells.num_filled();
}

int CountExpected(const Map& map, const View& previous, const View& view) {
  CellCount cells(map.camera());
  for (const std::optional<PointId>& point : previous.points) {
    if (!point || !map.IsAlive(*point)) continue;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*point).p_world;
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = map.camera().Project(p_cam);
    if (map.camera().Contains(pixel)) cells.Add(pixel);
  }
  return cells.num_filled();
}

PoseResult TrackPatches(Map& map, const View& near, View& view) {
  view.patch_noise = near.patch_noise;
  const ImageCells cells(map.camera());
  std::vector<std::vector<PatchCandidate>> candidates(cells.size());
  bool has_directions = false;
  for (const PointId point : PointsAround(map, near)) {
    if (!map.point(point).patch) continue;
    const std::optional<ProjectedPoint> at = ProjectMapPoint(map, point, view);
    if (!at) continue;
    has_directions |= map.point(point).depth_sigma > 0;
    candidates[cells.Index(at->pixel)].push_back(
        {point, at->pixel, static_cast<int>(map.point(point).observations.size()),
         map.point(point).depth_sigma > 0});
  }
  for (std::vector<PatchCandidate>& cell : candidates) {
    // Those of known depth that most keyframes see first.
    std::stable_sort(cell.begin(), cell.end(),
                     [](const PatchCandidate& a, const PatchCandidate& b) {
                       if (a.is_direction != b.is_direction) return b.is_direction;
                       return a.num_observations > b.num_observations;
                     });
  }
  std::vector<Feature> features;
  std::vector<std::optional<PointId>> points;
  const auto find = [&](const PatchCandidate& candidate) {
    ++map.point(candidate.point).num_predicted;
    const std::optional<Feature> found = FindPatch(map, candidate.point, view, candidate.pixel);
    if (!found) return false;
    features.push_back(*found);
    points.emplace_back(candidate.point);
    return true;
  };
  constexpr std::size_t kMaxTries = 3;  // in a cell: bounds the time of a frame
  std::vector<std::size_t> num_tried(cells.size(), 0);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t num_tries = std::min(candidates[i].size(), kMaxTries);
    while (num_tried[i] < num_tries && !find(candidates[i][num_tried[i]++])) continue;
  }
  // Where they are few, every one counts: the error of a pose falls with the root of their number.
  // So many show in most images; through a turn on the spot the scale rests on how many there are.
  constexpr std::size_t kEnough = 300;
  const auto are_wanted = [&] { return has_directions || features.size() < kEnough; };
  for (std::size_t i = 0; i < cells.size() && are_wanted(); ++i) {
    while (num_tried[i] < candidates[i].size()) find(candidates[i][num_tried[i]++]);
  }
  view.features = std::move(features);
  view.points = std::move(points);
  view.grid = FeatureGrid(view.features, map.camera().width, map.camera().height);
  const PoseResult result = RefinePoseAndNoise(map, view);
  for (const std::optional<PointId>& point : view.points) {
    if (point) ++map.point(*point).num_found;
  }
  return result;
}

}  // namespace mono3d::tracking
