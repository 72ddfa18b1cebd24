// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/scene.h"

namespace mono3d::synthetic {

// What a camera sees of a hit of `ray`: the surface under sun and sky, with shadow, reflection and
// haze. Linear red, green, blue. `pixel_width` is the width of a pixel at the end of the ray's
// direction, in metres: 1 / focal_px for a direction with z_cam = 1. One call shoots one shadow
// ray, unless the hit says whether it is sunlit, and, on water and glass, one reflected ray.
Eigen::Vector3f SurfaceRadiance(const Scene& scene, const Ray& ray, const Hit& hit,
                                float pixel_width);

// The same along a ray that may miss everything and see the sky.
Eigen::Vector3f Radiance(const Scene& scene, const Ray& ray, float pixel_width);

// Towards the sun from just above the surface: sunlit where nothing is in its way.
Ray ShadowRay(const Scene& scene, const Hit& hit, float time_s);

}  // namespace mono3d::synthetic
