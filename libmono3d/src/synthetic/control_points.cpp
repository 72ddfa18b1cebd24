// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/control_points.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "mono3d/geometry/distortion.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d ProjectInto(const CameraModel& camera, const Vector3d& p_cam) {
  return camera.HasDistortion() ? ProjectDistorted(camera, p_cam) : camera.Project(p_cam);
}

std::optional<Vector2d> PixelOf(const FilmedFlight& flight, int frame, const Vector3d& p_world) {
  const RollingShutter& shutter = flight.camera.shutter;
  Vector2d pixel(0.5 * (flight.camera.width - 1), 0.5 * (flight.camera.height - 1));
  // A line is read while the image moves by some pixels: each round leaves a hundredth of that.
  const int num_rounds = shutter.IsGlobal() ? 1 : 5;
  for (int round = 0; round < num_rounds; ++round) {
    const double late_s =
        shutter.readout_s *
        (shutter.IsGlobal() ? 0 : LineShare(flight.camera, pixel, shutter.reads_columns));
    const Vector3d p_cam = flight.T_world_cam_at(frame, late_s).Inverse() * p_world;
    if (!(p_cam.z() > 0)) return std::nullopt;
    // A lens may fold what is far outside its field back into the image.
    constexpr double kMostTangent = 2.5;
    if (p_cam.head<2>().norm() > kMostTangent * p_cam.z()) return std::nullopt;
    pixel = ProjectInto(flight.camera, p_cam);
  }
  // A mark at the very border is not one that anybody would make.
  constexpr double kBorder_px = 4;
  return flight.camera.Contains(pixel, kBorder_px) ? std::optional(pixel) : std::nullopt;
}

bool IsInView(const Scene& scene, const Pose& T_world_cam, const Vector3d& p_world) {
  const Vector3d to_point = p_world - T_world_cam.translation();
  const std::optional<Hit> hit =
      scene.Intersect({T_world_cam.translation().cast<float>(), to_point.cast<float>()});
  constexpr float kOnIt = 1e-3F;  // of the distance: what single precision holds, and more
  return hit && std::abs(hit->distance - 1) < kOnIt;
}

std::vector<TrueMark> MarksOf(const Scene& scene, const FilmedFlight& flight,
                              const Vector3d& p_world) {
  std::vector<TrueMark> marks;
  for (int frame = 0; frame < flight.num_frames; ++frame) {
    const std::optional<Vector2d> pixel = PixelOf(flight, frame, p_world);
    if (!pixel || !IsInView(scene, flight.T_world_cam_at(frame, 0), p_world)) continue;
    marks.push_back({frame, *pixel});
  }
  constexpr std::size_t kMostMarks = 30;
  if (marks.size() <= kMostMarks) return marks;
  std::vector<TrueMark> some;
  for (std::size_t i = 0; i < kMostMarks; ++i) {
    some.push_back(marks[i * (marks.size() - 1) / (kMostMarks - 1)]);
  }
  return some;
}

// What a frame shows near a place of its image, where that is flat.
std::optional<Vector3d> GroundIn(const Scene& scene, const FilmedFlight& flight, int frame,
                                 const Vector2d& share) {
  const CameraModel& camera = flight.camera;
  const std::optional<Vector3d> ray =
      UnprojectDistorted(camera, {share.x() * (camera.width - 1), share.y() * (camera.height - 1)});
  if (!ray) return std::nullopt;
  const Pose T_world_cam = flight.T_world_cam_at(frame, 0);
  const Vector3d direction = T_world_cam.rotation() * *ray;
  const std::optional<Hit> hit =
      scene.Intersect({T_world_cam.translation().cast<float>(), direction.cast<float>()});
  constexpr float kLeastUp = 0.9F;  // 26 degrees
  if (!hit || hit->is_moving || hit->normal.z() < kLeastUp) return std::nullopt;
  // Along the ray in double precision: the place in single precision is off by up to a millimetre.
  return Vector3d(T_world_cam.translation() + static_cast<double>(hit->distance) * direction);
}

}  // namespace

std::vector<TrueControlPoint> ControlPointsOf(const Scene& scene, const FilmedFlight& flight,
                                              int count) {
  // To both sides of the path, so that the points do not lie on a line.
  const std::array<Vector2d, 6> places = {Vector2d(0.2, 0.5),  Vector2d(0.8, 0.5),
                                          Vector2d(0.25, 0.7), Vector2d(0.75, 0.7),
                                          Vector2d(0.3, 0.9),  Vector2d(0.5, 0.6)};
  constexpr std::size_t kFewestMarks = 3;
  std::vector<TrueControlPoint> points;
  for (int i = 0; i < count; ++i) {
    const int frame = static_cast<int>((2LL * i + 1) * flight.num_frames / (2LL * count));
    for (std::size_t k = 0; k < places.size(); ++k) {
      const std::size_t place = (static_cast<std::size_t>(i) + k) % places.size();
      const std::optional<Vector3d> p_world = GroundIn(scene, flight, frame, places.at(place));
      if (!p_world) continue;
      std::vector<TrueMark> marks = MarksOf(scene, flight, *p_world);
      if (marks.size() < kFewestMarks) continue;
      points.push_back({*p_world, std::move(marks)});
      break;
    }
  }
  return points;
}

}  // namespace mono3d::synthetic
