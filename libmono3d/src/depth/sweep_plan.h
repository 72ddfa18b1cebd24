// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>

#include "depth/padded_image.h"
#include "depth/sweep_geometry.h"

namespace mono3d {

// The planes that are swept, and the level of the pyramid.
struct SweepPlan {
  int level = 0;
  LevelSize size;
  std::uint32_t num_planes = 0;
  std::uint32_t padded_planes = 0;  // as the kernels store them
  double inverse_depth = 0;         // of plane 0, the farthest, 1/su
  double step = 0;                  // from plane to plane, 1/su
};

struct SweepLimits {
  int level = 0;  // the finest allowed
  std::uint32_t max_planes = 0;
  std::uint64_t max_buffer_bytes = 0;
  std::function<std::uint32_t(std::uint32_t)> padded_planes;
};

LevelSize SizeAtLevel(const CameraModel& camera, int level);

// Planes through `range` and one beyond each end, spaced such that the projection moves by at most
// 1 px in the farthest matching camera; on the finest level on which they fit the limits. Requires
// geometry.PixelsPerInverseDepth(range) > 0.
SweepPlan PlanSweep(const SweepGeometry& geometry, const InverseDepthRange& range,
                    const SweepLimits& limits);

// Adds planes at the same step up to the inverse depth `nearest`, as far as the limits allow and a
// source still sees a tenth of the reference there.
void AddNearerPlanes(const SweepGeometry& geometry, double nearest, const SweepLimits& limits,
                     SweepPlan& plan);

// The same grid of planes one level finer, with twice the planes. Requires plan.level > 0.
SweepPlan Finer(const SweepPlan& plan, const CameraModel& camera);

}  // namespace mono3d
