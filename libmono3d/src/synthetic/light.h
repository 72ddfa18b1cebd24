// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

#include "mono3d/core/options.h"

namespace mono3d::synthetic {

// What lights a scene, and the air in it. Colours are linear: red, green, blue.
struct Light {
  // From the south-west, 43 degrees high: long enough shadows, no wall wholly lost in them.
  Eigen::Vector3f to_sun = Eigen::Vector3f(-0.62F, -0.38F, 0.68F).normalized();  // unit length
  Eigen::Vector3f sun{2.35F, 2.2F, 1.95F};  // on a surface that faces it
  Eigen::Vector3f sky{0.5F, 0.6F, 0.78F};   // on a surface that faces the zenith
  Eigen::Vector3f zenith{0.55F, 0.7F, 0.95F};
  Eigen::Vector3f horizon{0.8F, 0.85F, 0.95F};
  // At this distance haze leaves 2 % of the contrast (Koschmieder 1924).
  float visibility_m = std::numeric_limits<float>::infinity();
};

struct LightOptions {
  double sun_azimuth_deg = 211.5;  // of the sun's place, from the world's x axis towards y
  double sun_elevation_deg = 43;   // 3 to 90; a low sun is redder and throws long hard shadows
  double overcast = 0;             // 0: clear sky; 1: no sun comes through, no shadow
  double visibility_m = 0;         // haze: 2 % of the contrast is left there; 0: clear air

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The light of a sun and a sky like these.
Light MakeLight(const LightOptions& options);

// Radiance of the open sky in a direction of unit length.
Eigen::Vector3f SkyRadiance(const Light& light, const Eigen::Vector3f& direction);

// Share of a surface's radiance that comes through the air over this distance; the rest is
// replaced by the sky at the horizon.
float Transmittance(const Light& light, float distance_m);

}  // namespace mono3d::synthetic
