// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/pixel_shader.h"

#include <algorithm>
#include <cmath>

#include "synthetic/light.h"
#include "synthetic/shading.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kSameNormal = 0.95F;  // cosine: 18 degrees
// How far the hits of a patch may be apart in footprints of a pixel. A surface that is seen under
// less than some 25 degrees is longer than that within a pixel and gets several patches.
constexpr float kReach = 1.25F;
constexpr float kMinSlant = 0.1F;  // sine of the angle below which footprints grow no more

}  // namespace

void PixelShader::Add(const Ray& ray, const std::optional<Hit>& hit, float weight) {
  if (!hit) {
    sum_ += weight * SkyRadiance(scene_.light(), ray.direction.normalized());
    return;
  }
  Patch* const found = Find(*hit);
  Patch& patch = found != nullptr ? *found : Open(ray, *hit);
  patch.weight += weight;
  patch.ray.origin += weight * ray.origin;
  patch.ray.direction += weight * ray.direction;
  patch.ray.time_s += weight * ray.time_s;
  patch.hit.distance += weight * hit->distance;
  patch.hit.p += weight * hit->p;
  patch.hit.p_surface += weight * hit->p_surface;
  patch.hit.normal += weight * hit->normal;
}

Vector3f PixelShader::Radiance() {
  while (num_patches_ > 0) Shade(patches_[--num_patches_]);
  const Vector3f radiance = sum_;
  sum_.setZero();
  return radiance;
}

PixelShader::Patch* PixelShader::Find(const Hit& hit) {
  for (std::size_t i = 0; i < num_patches_; ++i) {
    const Hit& first = patches_[i].first;
    const float reach_m = patches_[i].reach_m;
    const bool is_same = first.surface == hit.surface && first.is_sunlit == hit.is_sunlit &&
                         first.is_moving == hit.is_moving &&
                         first.normal.dot(hit.normal) > kSameNormal &&
                         (first.p_surface - hit.p_surface).squaredNorm() < reach_m * reach_m;
    if (is_same) return &patches_[i];
  }
  return nullptr;
}

PixelShader::Patch& PixelShader::Open(const Ray& ray, const Hit& hit) {
  if (num_patches_ == patches_.size()) Shade(patches_[--num_patches_]);
  Patch& patch = patches_[num_patches_++];
  const float slant = -hit.normal.dot(ray.direction) / ray.direction.norm();
  patch.first = hit;
  patch.reach_m = kReach * hit.distance * pixel_width_ / std::sqrt(std::max(slant, kMinSlant));
  patch.weight = 0;
  patch.ray = {Vector3f::Zero(), Vector3f::Zero(), 0};
  patch.hit = hit;
  patch.hit.distance = 0;
  patch.hit.p.setZero();
  patch.hit.p_surface.setZero();
  patch.hit.normal.setZero();
  return patch;
}

void PixelShader::Shade(Patch& patch) {
  const float scale = 1 / patch.weight;
  patch.ray.origin *= scale;
  patch.ray.direction *= scale;
  patch.ray.time_s *= scale;
  patch.hit.distance *= scale;
  patch.hit.p *= scale;
  patch.hit.p_surface *= scale;
  patch.hit.normal.normalize();
  sum_ += patch.weight * SurfaceRadiance(scene_, patch.ray, patch.hit, pixel_width_);
}

}  // namespace mono3d::synthetic
