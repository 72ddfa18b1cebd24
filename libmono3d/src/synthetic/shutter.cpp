// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/shutter.h"

#include <algorithm>
#include <cmath>

namespace mono3d::synthetic {
namespace {

constexpr int kMaxSlices = 32;  // a blur of 32 px is still without gaps

// The longest way of a seen point over the image while the shutter is open, from a grid of rays.
double BlurLength_px(const Scene& scene, const CameraModel& camera, const Shot& shot,
                     double exposure_s) {
  const Pose T_world_cam = shot.motion(shot.t_s);
  const Pose T_begin_world = shot.motion(shot.t_s - exposure_s / 2).Inverse();
  const Pose T_end_world = shot.motion(shot.t_s + exposure_s / 2).Inverse();
  constexpr double kFar_m = 1e4;  // the sky turns but does not shift
  constexpr int kGrid = 8;        // rays each way
  double longest = 0;
  for (int j = 0; j <= kGrid; ++j) {
    for (int i = 0; i <= kGrid; ++i) {
      const Eigen::Vector2d pixel(i * (camera.width - 1.0) / kGrid,
                                  j * (camera.height - 1.0) / kGrid);
      const Eigen::Vector3d ray_cam = camera.Unproject(pixel);
      const Eigen::Vector3d ray_world = T_world_cam.rotation() * ray_cam;
      const std::optional<Hit> hit =
          scene.Intersect({T_world_cam.translation().cast<float>(), ray_world.cast<float>(),
                           static_cast<float>(shot.t_s)});
      const Eigen::Vector3d p_world =
          T_world_cam * Eigen::Vector3d((hit ? hit->distance : kFar_m) * ray_cam);
      const Eigen::Vector3d p_begin = T_begin_world * p_world;
      const Eigen::Vector3d p_end = T_end_world * p_world;
      if (p_begin.z() <= 0 || p_end.z() <= 0) continue;
      longest = std::max(longest, (camera.Project(p_end) - camera.Project(p_begin)).norm());
    }
  }
  return longest;
}

// A lattice turned against the pixel so that no two samples share a row or a column. The slices of
// an exposure take its two halves by turns, the white and the black fields of a chessboard: each
// half is centred as well.
std::vector<PixelSample> PlanSamples(int per_side, int num_slices) {
  std::vector<PixelSample> samples;
  for (int slice = 0; slice < num_slices; ++slice) {
    const std::size_t begin = samples.size();
    for (int j = 0; j < per_side; ++j) {
      for (int i = 0; i < per_side; ++i) {
        const bool is_other_half = per_side > 1 && num_slices > 1 && (i + j + slice) % 2 != 0;
        if (is_other_half) continue;
        const float n = static_cast<float>(per_side);
        const float a = (static_cast<float>(i) + 0.5F) / n - 0.5F;
        const float b = (static_cast<float>(j) + 0.5F) / n - 0.5F;
        samples.push_back({{a + b / n, b - a / n}, slice, 0});
      }
    }
    const auto num = static_cast<float>(samples.size() - begin);
    for (std::size_t i = begin; i < samples.size(); ++i) {
      samples[i].weight = 1 / (num * static_cast<float>(num_slices));
    }
  }
  return samples;
}

}  // namespace

Instant InstantOf(const Pose& T_world_cam, double t_s) {
  return {T_world_cam.translation().cast<float>(),
          T_world_cam.rotation().toRotationMatrix().cast<float>(), static_cast<float>(t_s)};
}

ShutterPlan PlanShutter(const Scene& scene, const CameraModel& camera, const Shot& shot,
                        const RenderOptions& options) {
  using Lines = ShutterPlan::Lines;
  const SensorOptions& sensor = options.sensor;
  ShutterPlan plan;
  if (sensor.exposure_s > 0) {
    // A slice for each pixel of blur, each with half of the lattice: as many samples as a still
    // picture has, as long as the blur is below two pixels.
    const double blur_px = BlurLength_px(scene, camera, shot, sensor.exposure_s);
    plan.num_slices = 2 * std::clamp(static_cast<int>(std::ceil(blur_px / 2)), 1, kMaxSlices / 2);
  }
  plan.samples = PlanSamples(options.samples_per_side, plan.num_slices);
  const bool is_rolling = sensor.readout_s > 0;
  if (is_rolling) plan.lines = ReadsColumns(sensor) ? Lines::kColumns : Lines::kRows;
  const int num_lines = is_rolling ? NumLines(sensor, camera.width, camera.height) : 1;
  const double sign = ReadsBackwards(sensor) ? -1 : 1;
  for (int i = 0; i < num_lines; ++i) {
    const double line = num_lines > 1 ? sign * (i / (num_lines - 1.0) - 0.5) : 0;
    for (int slice = 0; slice < plan.num_slices; ++slice) {
      const double part = (slice + 0.5) / plan.num_slices - 0.5;
      const double t_s = shot.t_s + line * sensor.readout_s + part * sensor.exposure_s;
      plan.instants.push_back(InstantOf(shot.motion(t_s), t_s));
    }
  }
  return plan;
}

}  // namespace mono3d::synthetic
