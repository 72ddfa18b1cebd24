// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/map_start.h"

#include <Eigen/Cholesky>
#include <cstddef>
#include <optional>
#include <utility>

#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

// Gives a point of the start its patch from the first view and its position in the second to a
// fraction of a pixel.
void RefineStartByPatchAlignment(Map& map, PointId point) {
  const Observation in_a = map.point(point).observations.front();
  const Observation in_b = map.point(point).observations.back();
  Feature& a = map.keyframe(in_a.keyframe).view.features[in_a.feature];
  Feature& b = map.keyframe(in_b.keyframe).view.features[in_b.feature];
  if (!TakePatchOf(map, point, in_a.keyframe, a)) return;
  const auto found = FindPatch(map, point, map.keyframe(in_b.keyframe).view, b.pixel);
  if (!found) return;
  b.pixel = found->pixel;
  b.sigma_px = found->sigma_px;
  a.sigma_px = found->sigma_px;
}

// How a view of the start turns while its lines are read: as its image moves meanwhile, but for
// what its way moves what it shows. By least squares over the points of the start; nothing where
// the image has no motion that is known.
std::optional<Eigen::Vector3d> AngularVelocity(const Map& map, const View& view,
                                               const Eigen::Vector3d& linear_su_per_s) {
  const CameraModel& camera = view.frame.camera;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    if (!view.points[i] || view.image_motion.neighbours().empty()) continue;
    const Eigen::Vector2d& pixel = view.features[i].pixel;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*view.points[i]).p_world;
    const double line_s = view.image_motion.LineTime_s(pixel);
    const Eigen::Vector3d p_line = p_cam + line_s * linear_su_per_s;
    if (p_cam.z() <= 0 || p_line.z() <= 0) continue;
    const Eigen::Vector2d moved = pixel - view.image_motion.AtMiddleLine(pixel);
    const Eigen::Vector2d by_way = camera.Project(p_line) - camera.Project(p_cam);
    const Eigen::Matrix<double, 2, 3> by_turn =
        line_s * ProjectionJacobian(camera, p_cam, p_cam).leftCols<3>();
    information += by_turn.transpose() * by_turn;
    gradient += by_turn.transpose() * (moved - by_way);
  }
  const Eigen::Vector3d angular = information.ldlt().solve(gradient);
  return information.isZero() || !angular.allFinite() ? std::nullopt : std::optional(angular);
}

// By the motion between the two views, and by that of their images, until the poses of their
// neighbours are known.
void SetStartVelocity(const MapStart& start, Map& map) {
  const double duration_s = start.second.frame.timestamp_s - start.first.frame.timestamp_s;
  const CameraVelocity mean = VelocityOf(start.motion.T_b_a, duration_s);
  for (const KeyframeId id : {0, 1}) {
    View& view = map.keyframe(id).view;
    CameraVelocity velocity = mean;
    const auto angular = AngularVelocity(map, view, mean.linear_su_per_s);
    if (angular) velocity.angular_rad_per_s = *angular;
    view.shutter = {view.frame.sensor, velocity};
    view.image_motion = {};
  }
}

}  // namespace

void FillMap(const MapStart& start, Map& map) {
  View a = start.first;
  View b = start.second;
  a.T_cam_world = Pose();
  b.T_cam_world = start.motion.T_b_a;
  const KeyframeId id_a = map.AddKeyframe(std::move(a));
  const KeyframeId id_b = map.AddKeyframe(std::move(b));
  for (std::size_t i = 0; i < start.motion.matches.size(); ++i) {
    const PointId point = map.AddPoint(start.motion.p_a[i]);
    map.AddObservation(point, {id_a, start.motion.matches[i].feature_a});
    map.AddObservation(point, {id_b, start.motion.matches[i].feature_b});
    map.UpdatePoint(point);
    RefineStartByPatchAlignment(map, point);
  }
  SetStartVelocity(start, map);
  // Two views alone know less than those that the motion was adjusted over, above all of a plane.
  if (start.motion.is_adjusted) {
    RemoveOutliers(map);
  } else {
    AdjustAll(map);
  }
  const float median = UpperMedianOrZero(map.Depths(map.keyframe(id_a).view));
  if (median > 0) map.Rescale(1 / median);
}

}  // namespace mono3d::tracking
