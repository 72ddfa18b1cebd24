// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/light.h"

#include <algorithm>
#include <cmath>

namespace mono3d::synthetic {
namespace {

constexpr float kExtinctionAtVisibility = 3.912F;  // -ln(0.02)

}  // namespace

Eigen::Vector3f SkyRadiance(const Light& light, const Eigen::Vector3f& direction) {
  const float height = std::clamp(direction.z(), 0.0F, 1.0F);
  return light.zenith + (1 - height) * (light.horizon - light.zenith);
}

float Transmittance(const Light& light, float distance_m) {
  if (std::isinf(light.visibility_m)) return 1;
  return std::exp(-kExtinctionAtVisibility * distance_m / light.visibility_m);
}

}  // namespace mono3d::synthetic
