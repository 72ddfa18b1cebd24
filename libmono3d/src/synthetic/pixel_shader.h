// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "synthetic/scene.h"

namespace mono3d::synthetic {

// Adds up what the rays of a pixel see. Rays that meet the same piece of surface, under the same
// light, are shaded once, in their middle: detail finer than a pixel is not drawn anyway. Edges and
// shadows keep every ray.
class PixelShader {
 public:
  // `pixel_width` is that of SurfaceRadiance. The scene must outlive this.
  PixelShader(const Scene& scene, float pixel_width) : scene_(scene), pixel_width_(pixel_width) {}

  // The weights of a pixel's rays add up to 1. A hit must know whether it is sunlit.
  void Add(const Ray& ray, const std::optional<Hit>& hit, float weight);

  // Of all rays since the last call: linear red, green, blue.
  Eigen::Vector3f Radiance();

 private:
  struct Patch {
    Ray ray;  // sums over the rays, by weight
    Hit hit;
    Hit first;
    float reach_m = 0;  // a hit further than this from the first one belongs to another patch
    float weight = 0;
  };

  Patch* Find(const Hit& hit);
  Patch& Open(const Ray& ray, const Hit& hit);
  void Shade(Patch& patch);

  const Scene& scene_;
  float pixel_width_;
  Eigen::Vector3f sum_ = Eigen::Vector3f::Zero();
  std::array<Patch, 8> patches_;
  std::size_t num_patches_ = 0;
};

}  // namespace mono3d::synthetic
