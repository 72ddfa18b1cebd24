// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/direct_tracking.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mono3d/geometry/triangulation.h"
#include "tracking/image_alignment.h"
#include "tracking/image_cells.h"
#include "tracking/matching.h"

namespace mono3d::tracking {
namespace {

// Correlation of a patch with itself seen from elsewhere stays above, with others rarely.
constexpr double kMinCorrelation = 0.8;
// px of the octave of alignment: what remains besides the noise of the image, by the bilinear
// interpolation, surfaces that are no planes, a calibration that is nearly right.
constexpr double kSigmaBesidesNoise = 0.07;

struct Candidate {
  PointId point = 0;
  Eigen::Vector2d pixel;
  int num_observations = 0;
};

// The points of the keyframes that see what `near` sees.
std::vector<PointId> PointsAround(const Map& map, const View& near) {
  constexpr std::size_t kMaxKeyframes = 15;
  std::vector<PointId> points;
  std::vector<char> is_listed(map.points().size(), 0);
  const auto list = [&](const std::vector<std::optional<PointId>>& seen) {
    for (const std::optional<PointId>& point : seen) {
      if (!point || is_listed[*point] != 0 || !map.point(*point).alive) continue;
      is_listed[*point] = 1;
      points.push_back(*point);
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
    if (!point || !map.point(*point).alive) continue;
    const Eigen::Vector3d p_cam = previous.T_cam_world * map.point(*point).p_world;
    if (p_cam.z() > 0) seen.push_back({map.camera().Project(p_cam), p_cam});
  }
  return seen;
}

// Red, green, blue; as it was where the image has been released.
std::array<std::uint8_t, 3> ColourAt(const cv::Mat& bgr, const Eigen::Vector2d& pixel,
                                     const std::array<std::uint8_t, 3>& before) {
  if (bgr.empty()) return before;
  const auto& colour = bgr.at<cv::Vec3b>(static_cast<int>(std::lround(pixel.y())),
                                         static_cast<int>(std::lround(pixel.x())));
  return {colour[2], colour[1], colour[0]};
}

// How a known point looks in `view` by its patch.
std::optional<PatchWarp> WarpInto(const Map& map, const MapPoint& point, const View& view) {
  const Pose T_patch_world = map.T_cam_world(point.patch_keyframe);
  const Eigen::Vector3d p_patch = T_patch_world * point.p_world;
  if (p_patch.z() <= 0) return std::nullopt;
  return WarpPatch(map.camera(), view.T_cam_world * T_patch_world.Inverse(), point.patch->pixel,
                   p_patch.z(), point.patch->slope.value);
}

// What the patch that the point has had so far knows of the slope, for its next one.
std::optional<SurfaceSlope> SlopeSoFar(const Map& map, const MapPoint& point, const View& view,
                                       const Eigen::Vector2d& pixel) {
  if (!point.patch) return std::nullopt;
  const Eigen::Quaterniond R =
      view.T_cam_world.rotation() * map.T_cam_world(point.patch_keyframe).rotation().conjugate();
  return SlopeInOther(map.camera(), R, point.patch->pixel, point.patch->slope, pixel);
}

}  // namespace

bool TakePatchOf(Map& map, PointId id, KeyframeId keyframe, const Feature& feature) {
  const View& view = map.keyframe(keyframe).view;
  if (view.octaves.empty()) return false;
  constexpr double kCoarse = 2;
  const int octave = map.scales().Scale(feature.level) >= kCoarse ? 1 : 0;
  std::optional<Patch> patch = TakePatch(view.octaves, feature.pixel, octave);
  if (!patch) return false;
  MapPoint& point = map.point(id);
  patch->slope = SlopeSoFar(map, point, view, feature.pixel)
                     .value_or(UnknownSlope(map.camera(), feature.pixel));
  point.patch = *std::move(patch);
  point.patch_keyframe = keyframe;
  point.colour = ColourAt(view.frame.bgr, feature.pixel, point.colour);
  return true;
}

bool LooksAlike(const Map& map, const MapPoint& point, KeyframeId from,
                const Eigen::Vector3d& centre) {
  constexpr double kMinCosine = 0.985;  // 10 degrees: beyond, what is no plane looks otherwise
  constexpr double kMaxScale = 1.3;
  const Eigen::Vector3d centre_from = map.T_cam_world(from).Inverse().translation();
  const double before = (centre_from - point.p_world).norm();
  const double now = (centre - point.p_world).norm();
  return CosParallax(point.p_world, centre_from, centre) > kMinCosine && now < kMaxScale * before &&
         before < kMaxScale * now;
}

std::optional<Feature> FindPatch(const Map& map, PointId id, const View& view,
                                 const Eigen::Vector2d& start_px) {
  const MapPoint& point = map.point(id);
  if (!point.patch || view.octaves.empty()) return std::nullopt;
  const std::optional<PatchWarp> warp = WarpInto(map, point, view);
  if (!warp) return std::nullopt;
  const std::optional<PatchPosition> found =
      AlignPatch(*point.patch, warp->by_pixel, view.octaves, start_px);
  if (!found || found->correlation < kMinCorrelation) return std::nullopt;
  const Observation& newest = point.observations.back();
  Feature feature;
  feature.pixel = found->pixel;
  feature.level =
      map.scales().Nearest((view.T_cam_world * point.p_world).norm(), point.max_distance);
  feature.angle_deg = map.keyframe(newest.keyframe).view.features[newest.feature].angle_deg;
  feature.descriptor = point.descriptor;
  feature.sigma_px =
      std::hypot(kSigmaBesidesNoise * std::ldexp(1.0, found->octave), found->sigma_px);
  return feature;
}

void LearnSlopes(Map& map, KeyframeId keyframe) {
  const View& view = map.keyframe(keyframe).view;
  if (view.octaves.empty()) return;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i]) continue;
    MapPoint& point = map.point(*view.points[i]);
    if (!point.patch || point.patch_keyframe == keyframe) continue;
    const std::optional<PatchWarp> warp = WarpInto(map, point, view);
    if (!warp) continue;
    const std::optional<SlopeEvidence> evidence =
        MeasureSlope(*point.patch, *warp, view.octaves, view.features[i].pixel);
    if (!evidence) continue;
    const SurfaceSlope& before = point.patch->slope;
    SurfaceSlope slope;
    slope.information = before.information + evidence->information;
    slope.value = slope.information.inverse() *
                  (before.information * before.value + evidence->weighted_slope);
    if (IsPlausible(map.camera(), point.patch->pixel, slope.value)) point.patch->slope = slope;
  }
}

PoseResult TrackDirectly(Map& map, const View& previous, View& view) {
  const Pose T_view_previous = view.T_cam_world * previous.T_cam_world.Inverse();
  view.T_cam_world = AlignImages(map.camera(), previous.octaves, SeenPoints(map, previous),
                                 view.octaves, T_view_previous) *
                     previous.T_cam_world;
  return TrackPatches(map, previous, view);
}

int CountTrackable(const Map& map, const View& view) {
  constexpr std::size_t kMinObservations = 3;
  const ImageCells cells(map.camera());
  std::vector<char> is_filled(cells.size(), 0);
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i] || !map.camera().Contains(view.features[i].pixel)) continue;
    if (map.point(*view.points[i]).observations.size() < kMinObservations) continue;
    is_filled[cells.Index(view.features[i].pixel)] = 1;
  }
  return static_cast<int>(std::count(is_filled.begin(), is_filled.end(), 1));
}

int CountExpected(const Map& map, const View& previous, const View& view) {
  const ImageCells cells(map.camera());
  std::vector<char> is_filled(cells.size(), 0);
  for (const std::optional<PointId>& point : previous.points) {
    if (!point || !map.point(*point).alive) continue;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*point).p_world;
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = map.camera().Project(p_cam);
    if (map.camera().Contains(pixel)) is_filled[cells.Index(pixel)] = 1;
  }
  return static_cast<int>(std::count(is_filled.begin(), is_filled.end(), 1));
}

PoseResult TrackPatches(Map& map, const View& near, View& view) {
  const ImageCells cells(map.camera());
  std::vector<std::vector<Candidate>> candidates(cells.size());
  for (const PointId point : PointsAround(map, near)) {
    if (!map.point(point).patch) continue;
    const std::optional<ProjectedPoint> at = ProjectMapPoint(map, point, view);
    if (!at) continue;
    candidates[cells.Index(at->pixel)].push_back(
        {point, at->pixel, static_cast<int>(map.point(point).observations.size())});
  }
  for (std::vector<Candidate>& cell : candidates) {
    // Those that most keyframes see first.
    std::stable_sort(cell.begin(), cell.end(), [](const Candidate& a, const Candidate& b) {
      return a.num_observations > b.num_observations;
    });
  }
  std::vector<Feature> features;
  std::vector<std::optional<PointId>> points;
  const auto find = [&](const Candidate& candidate) {
    ++map.point(candidate.point).num_predicted;
    const std::optional<Feature> found = FindPatch(map, candidate.point, view, candidate.pixel);
    if (!found) return false;
    features.push_back(*found);
    points.emplace_back(candidate.point);
    return true;
  };
  constexpr std::size_t kMaxTries = 3;
  std::vector<std::size_t> num_tried(cells.size(), 0);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t num_tries = std::min(candidates[i].size(), kMaxTries);
    while (num_tried[i] < num_tries && !find(candidates[i][num_tried[i]++])) continue;
  }
  // Where they are few, as on the strip that three images far apart share, every one counts.
  constexpr std::size_t kFew = 100;
  for (std::size_t i = 0; i < cells.size() && features.size() < kFew; ++i) {
    while (num_tried[i] < candidates[i].size()) find(candidates[i][num_tried[i]++]);
  }
  view.features = std::move(features);
  view.points = std::move(points);
  view.grid = FeatureGrid(view.features, map.camera().width, map.camera().height);
  const PoseResult result = RefinePose(map, view);
  for (const std::optional<PointId>& point : view.points) {
    if (point) ++map.point(*point).num_found;
  }
  return result;
}

}  // namespace mono3d::tracking
