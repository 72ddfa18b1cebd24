// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/shading.h"

#include <algorithm>
#include <cmath>

#include "synthetic/light.h"
#include "synthetic/material.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

// Shadow rays start this far off the surface: far above the rounding of coordinates of some 100 m
// in single precision (1e-5 m), far below anything that throws a shadow of a pixel.
constexpr float kRayOffset_m = 2e-3F;

// Light that falls on a surface: the sky, and the sun where nothing is in its way.
Vector3f Irradiance(const Scene& scene, const Hit& hit, float time_s) {
  const Light& light = scene.light();
  Vector3f irradiance = light.sky * (0.62F + 0.38F * hit.normal.z());
  const float sun = hit.normal.dot(light.to_sun);
  if (sun > 0 && !scene.IsOccluded({hit.p + kRayOffset_m * hit.normal, light.to_sun, time_s})) {
    irradiance += sun * light.sun;
  }
  return irradiance;
}

}  // namespace

Vector3f SurfaceRadiance(const Scene& scene, const Ray& ray, const Hit& hit, float pixel_width) {
  const float length = ray.direction.norm();
  const float slant = std::max(-hit.normal.dot(ray.direction) / length, 0.1F);
  const float footprint_m = hit.distance * pixel_width / std::sqrt(slant);
  const Vector3f albedo = Albedo(*hit.surface, &scene.ground(), hit.p_surface, footprint_m);
  const Vector3f radiance = albedo.cwiseProduct(Irradiance(scene, hit, ray.time_s));
  const float share = Transmittance(scene.light(), hit.distance * length);
  return share * radiance + (1 - share) * scene.light().horizon;
}

Vector3f Radiance(const Scene& scene, const Ray& ray, float pixel_width) {
  const std::optional<Hit> hit = scene.Intersect(ray);
  if (!hit) return SkyRadiance(scene.light(), ray.direction.normalized());
  return SurfaceRadiance(scene, ray, *hit, pixel_width);
}

}  // namespace mono3d::synthetic
