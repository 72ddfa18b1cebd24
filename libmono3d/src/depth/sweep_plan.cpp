// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sweep_plan.h"

#include <algorithm>
#include <cmath>

namespace mono3d {
namespace {

// Below this many pixels a side there is no room for census windows and paths, and no coarser
// level.
constexpr std::uint32_t kMinSide = 32;

// Nearer surfaces are seen by no source but at the border of the reference.
constexpr double kMinSeen = 0.1;

// Bytes of the sums of SGM, the largest volume.
std::uint64_t SumBytes(const LevelSize& size, std::uint32_t padded_planes) {
  return std::uint64_t{2} * size.num_pixels() * padded_planes;
}

}  // namespace

LevelSize SizeAtLevel(const CameraModel& camera, int level) {
  LevelSize size{static_cast<std::uint32_t>(camera.width),
                 static_cast<std::uint32_t>(camera.height)};
  for (int i = 0; i < level; ++i) size = size.Halved();
  return size;
}

SweepPlan PlanSweep(const SweepGeometry& geometry, const InverseDepthRange& range,
                    const SweepLimits& limits) {
  const double motion_px = (range.nearest - range.farthest) * geometry.PixelsPerInverseDepth(range);
  SweepPlan plan;
  for (plan.level = limits.level;; ++plan.level) {
    plan.size = SizeAtLevel(geometry.camera(), plan.level);
    // Planes from end to end, then one more on each side: no estimate is taken from the outermost.
    const double intervals = std::max(1.0, std::ceil(motion_px / std::pow(2.0, plan.level)));
    const double num_planes = std::min(intervals + 3, double(limits.max_planes));
    plan.num_planes = static_cast<std::uint32_t>(num_planes);
    plan.padded_planes = limits.padded_planes(plan.num_planes);
    plan.step = (range.nearest - range.farthest) / (num_planes - 3);
    plan.inverse_depth = std::max(0.0, range.farthest - plan.step);
    const bool fits = intervals + 3 <= limits.max_planes &&
                      SumBytes(plan.size, plan.padded_planes) <= limits.max_buffer_bytes;
    const LevelSize coarser = plan.size.Halved();
    if (fits || std::min(coarser.width_px, coarser.height_px) < kMinSide) return plan;
  }
}

void AddNearerPlanes(const SweepGeometry& geometry, double nearest, const SweepLimits& limits,
                     SweepPlan& plan) {
  const auto fits = [&](std::uint32_t num_planes) {
    return num_planes <= limits.max_planes &&
           SumBytes(plan.size, limits.padded_planes(num_planes)) <= limits.max_buffer_bytes;
  };
  // No estimate is taken from the outermost plane.
  const auto nearest_estimate = [&] {
    return plan.inverse_depth + plan.step * (plan.num_planes - 2);
  };
  while (nearest_estimate() < nearest && fits(plan.num_planes + 1) &&
         geometry.VisibleShare(nearest_estimate() + plan.step) >= kMinSeen) {
    ++plan.num_planes;
  }
  plan.padded_planes = limits.padded_planes(plan.num_planes);
}

SweepPlan Finer(const SweepPlan& plan, const CameraModel& camera) {
  SweepPlan finer = plan;
  --finer.level;
  finer.size = SizeAtLevel(camera, finer.level);
  finer.step = 0.5 * plan.step;
  finer.num_planes = 2 * plan.num_planes - 1;
  finer.padded_planes = 0;
  return finer;
}

}  // namespace mono3d
