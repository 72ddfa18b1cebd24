// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/point_patches.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/clamped_int.h"
#include "mono3d/geometry/triangulation.h"

namespace mono3d::tracking {
namespace {

// Correlation of a patch with itself seen from elsewhere stays above, with others rarely.
constexpr double kMinCorrelation = 0.8;

// Red, green, blue; as it was where the image has been released.
std::array<std::uint8_t, 3> ColourAt(const cv::Mat& bgr, const Eigen::Vector2d& pixel,
                                     const std::array<std::uint8_t, 3>& before) {
  if (bgr.empty()) return before;
  const auto& colour = bgr.at<cv::Vec3b>(ClampedInt(std::round(pixel.y()), 0, bgr.rows - 1),
                                         ClampedInt(std::round(pixel.x()), 0, bgr.cols - 1));
  return {colour[2], colour[1], colour[0]};
}

// How a known point looks in `view` by its patch.
std::optional<PatchWarp> WarpInto(const Map& map, const MapPoint& point, const View& view) {
  const Pose T_patch_world = map.T_cam_world(point.patch_keyframe);
  const Eigen::Vector3d p_patch = T_patch_world * point.p_world;
  if (p_patch.z() <= 0) return std::nullopt;
  return WarpPatch(map.camera(), view.T_cam_world * T_patch_world.Inverse(), point.patch->pixel,
                   p_patch.z(), point.patch->normal.value);
}

// What the patch that the point has had so far knows of the normal, for its next one.
std::optional<PatchNormal> NormalSoFar(const Map& map, const MapPoint& point, const View& view,
                                       const Eigen::Vector2d& pixel) {
  if (!point.patch) return std::nullopt;
  const Eigen::Quaterniond R =
      view.T_cam_world.rotation() * map.T_cam_world(point.patch_keyframe).rotation().conjugate();
  return NormalInOther(map.camera(), R, point.patch->pixel, point.patch->normal, pixel);
}

}  // namespace

bool TakePatchOf(Map& map, PointId id, KeyframeId keyframe, const Feature& feature) {
  const View& view = map.keyframe(keyframe).view;
  if (view.octaves.empty()) return false;
  constexpr double kCoarse = 2;  // from here on the next octave shows all that the level does
  const int octave = map.scales().Scale(feature.level) >= kCoarse ? 1 : 0;
  std::optional<Patch> patch = TakePatch(view.octaves, feature.pixel, octave);
  if (!patch) return false;
  MapPoint& point = map.point(id);
  patch->normal = NormalSoFar(map, point, view, feature.pixel)
                      .value_or(UnknownNormal(map.camera(), feature.pixel));
  point.patch = *std::move(patch);
  point.patch_keyframe = keyframe;
  point.colour = ColourAt(view.frame.bgr, feature.pixel, point.colour);
  return true;
}

bool LooksAlike(const Map& map, const MapPoint& point, KeyframeId from,
                const Eigen::Vector3d& centre) {
  constexpr double kMinCosine = 0.985;  // 10 degrees: beyond, what is no plane looks otherwise
  constexpr double kMaxScale = 1.3;     // a third of an octave
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
      std::hypot(map.patch_sigma_px() * std::ldexp(1.0, found->octave), found->sigma_px);
  return feature;
}

void EstimatePatchNormals(Map& map, KeyframeId keyframe) {
  const View& view = map.keyframe(keyframe).view;
  if (view.octaves.empty()) return;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i]) continue;
    MapPoint& point = map.point(*view.points[i]);
    if (!point.patch || point.patch_keyframe == keyframe) continue;
    const std::optional<PatchWarp> warp = WarpInto(map, point, view);
    if (!warp) continue;
    const std::optional<NormalEvidence> evidence =
        MeasureNormal(*point.patch, *warp, view.octaves, view.features[i].pixel);
    if (!evidence) continue;
    const PatchNormal& before = point.patch->normal;
    PatchNormal normal;
    normal.information = before.information + evidence->information;
    normal.value = normal.information.inverse() *
                   (before.information * before.value + evidence->weighted_normal);
    if (IsPlausible(map.camera(), point.patch->pixel, normal.value)) point.patch->normal = normal;
  }
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

}  // namespace mono3d::tracking
