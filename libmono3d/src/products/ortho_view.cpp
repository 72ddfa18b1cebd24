// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/ortho_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

// Over this share of its width and height an image fades out, so that one that ends does not leave
// an edge.
constexpr double kFadeShare = 0.05;

// Flatter than this, a view shows nothing of what a map shows.
constexpr double kMinDownwards = 0.2;

// The cosine of the angle to the axis up to which pixels go outwards with it, and not farther than
// the corners of the image.
double AxisCosineOfUse(const CameraModel& camera) {
  const double corner = std::hypot(std::max(camera.cx, camera.width - camera.cx),
                                   std::max(camera.cy, camera.height - camera.cy));
  constexpr double kStep_rad = 0.002;
  double last = 0, angle = 0;
  while (angle + kStep_rad < 0.49 * std::numbers::pi) {
    const double next = angle + kStep_rad;
    const Eigen::Vector2d pixel = ProjectDistorted(camera, {std::sin(next), 0, std::cos(next)});
    const double radius = std::hypot(pixel.x() - camera.cx, pixel.y() - camera.cy);
    if (!(radius > last)) break;
    angle = next;
    last = radius;
    // Some more than the corner: tangential distortion and unequal focal lengths.
    if (radius > 1.1 * corner) break;
  }
  return std::cos(angle);
}

}  // namespace

OrthoView::OrthoView(const CameraModel& camera, const Pose& T_world_cam)
    : camera_(camera),
      rotation_(T_world_cam.rotation().toRotationMatrix().transpose()),
      centre_(T_world_cam.translation()),
      min_axis_cosine_(AxisCosineOfUse(camera)),
      focal_px_(std::sqrt(camera.fx * camera.fy)) {}

std::optional<OrthoView::Sight> OrthoView::See(const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d to_place = p_world - centre_;
  const double distance = to_place.norm();
  const double downwards = -to_place.z() / distance;
  if (!(downwards > kMinDownwards)) return std::nullopt;
  const Eigen::Vector3d p_cam = rotation_ * to_place;
  const double axis_cosine = p_cam.z() / distance;
  if (!(axis_cosine > min_axis_cosine_)) return std::nullopt;
  const Eigen::Vector2d pixel = ProjectDistorted(camera_, p_cam);
  const double inside_x = std::min(pixel.x(), camera_.width - 1 - pixel.x());
  const double inside_y = std::min(pixel.y(), camera_.height - 1 - pixel.y());
  if (!(inside_x > 0 && inside_y > 0)) return std::nullopt;
  const double fade = std::min(
      {1.0, inside_x / (kFadeShare * camera_.width), inside_y / (kFadeShare * camera_.height)});
  // Pixels per area of the map: those of a plane across the line of sight, foreshortened. Towards
  // the border lenses get darker and less sharp; the light falls with the fourth power of the
  // cosine (of a lens without vignetting of its own).
  const double scale = focal_px_ / distance;
  const double light = axis_cosine * axis_cosine * axis_cosine * axis_cosine;
  return Sight{.pixel = pixel.cast<float>(),
               .quality = static_cast<float>(scale * scale * downwards * light * fade)};
}

bool OrthoView::MaySee(const Eigen::Vector3d& p_world, double radius) const {
  const Eigen::Vector3d p_cam = rotation_ * (p_world - centre_);
  const double distance = p_cam.norm();
  if (distance <= radius) return true;
  const double angle = std::acos(std::clamp(p_cam.z() / distance, -1.0, 1.0));
  return angle - std::asin(radius / distance) <= std::acos(min_axis_cosine_);
}

double OrthoView::PixelsPer(double length, const Eigen::Vector3d& p_world) const {
  return focal_px_ * length / (p_world - centre_).norm();
}

}  // namespace mono3d
