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
  if (sun <= 0) return irradiance;
  const bool is_sunlit =
      hit.is_sunlit ? *hit.is_sunlit : !scene.IsOccluded(ShadowRay(scene, hit, time_s));
  if (is_sunlit) irradiance += sun * light.sun;
  return irradiance;
}

// The part of a ray's way that lies before its origin, and how it may go on.
struct Way {
  float before = 0;  // in lengths of the ray's direction
  bool may_reflect = true;
};

struct Eye {
  const Scene& scene;
  float pixel_width;
};

Vector3f SurfaceRadianceOn(const Eye& eye, const Ray& ray, const Hit& hit, const Way& way);

Vector3f RadianceOn(const Eye& eye, const Ray& ray, const Way& way) {
  const std::optional<Hit> hit = eye.scene.Intersect(ray);
  if (!hit) return SkyRadiance(eye.scene.light(), ray.direction.normalized());
  return SurfaceRadianceOn(eye, ray, *hit, way);
}

// What a mirroring surface shows of its surroundings; reflections in reflections are left out.
Vector3f Reflection(const Eye& eye, const Ray& ray, const Hit& hit, float footprint_m) {
  Vector3f normal = hit.normal;
  const bool is_water = hit.surface->material == Material::kWater;
  if (is_water) {
    const Eigen::Vector2f slope = RippleSlope(*hit.surface, hit.p_surface.head<2>(), footprint_m);
    normal = (normal - Vector3f(slope.x(), slope.y(), 0)).normalized();
  }
  Vector3f mirrored = ray.direction - 2 * normal.dot(ray.direction) * normal;
  constexpr float kMin = 0.01F;  // a ripple's far side does not look into the water
  const float away = mirrored.dot(hit.normal);
  const float least = kMin * ray.direction.norm();
  if (away < least) mirrored += (least - away) * hit.normal;
  const Ray on{hit.p + kRayOffset_m * hit.normal, mirrored, ray.time_s};
  return RadianceOn(eye, on, {hit.distance, false});
}

Vector3f SurfaceRadianceOn(const Eye& eye, const Ray& ray, const Hit& hit, const Way& way) {
  const float length = ray.direction.norm();
  const float cosine = -hit.normal.dot(ray.direction) / length;
  const float distance = way.before + hit.distance;
  const float footprint_m = distance * eye.pixel_width / std::sqrt(std::max(cosine, 0.1F));
  const Vector3f albedo = Albedo(*hit.surface, &eye.scene.ground(), hit.p_surface, footprint_m);
  Vector3f radiance = albedo.cwiseProduct(Irradiance(eye.scene, hit, ray.time_s));
  const float mirrored = way.may_reflect ? Reflectance(hit.surface->material, cosine) : 0;
  if (mirrored > 0) {
    radiance += mirrored * (Reflection(eye, ray, hit, footprint_m) - radiance);
  }
  const Light& light = eye.scene.light();
  const float share = Transmittance(light, hit.distance * length);
  return share * radiance + (1 - share) * light.horizon;
}

}  // namespace

Ray ShadowRay(const Scene& scene, const Hit& hit, float time_s) {
  return {hit.p + kRayOffset_m * hit.normal, scene.light().to_sun, time_s};
}

Vector3f SurfaceRadiance(const Scene& scene, const Ray& ray, const Hit& hit, float pixel_width) {
  return SurfaceRadianceOn({scene, pixel_width}, ray, hit, {});
}

Vector3f Radiance(const Scene& scene, const Ray& ray, float pixel_width) {
  return RadianceOn({scene, pixel_width}, ray, {});
}

}  // namespace mono3d::synthetic
