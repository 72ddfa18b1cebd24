// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synthetic/numbers.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kExtinctionAtVisibility = 3.912F;  // -ln(0.02)

constexpr double kDegree = std::numbers::pi / 180;
// Optical depth of clear air overhead: blue is scattered most. The default light is that of the
// reference elevation.
const Vector3f kOpticalDepth(0.1F, 0.15F, 0.26F);
constexpr double kReferenceElevation_deg = 43;

// Way of the sun's light through the air, overhead = 1 (Kasten and Young 1989).
float AirMass(double elevation_deg) {
  return static_cast<float>(1 / (std::sin(elevation_deg * kDegree) +
                                 0.50572 * std::pow(elevation_deg + 6.07995, -1.6364)));
}

// Mean light on ground and walls: what a camera would set its exposure by.
float Level(const Light& light) {
  return (light.sky + (0.6F * light.to_sun.z() + 0.25F) * light.sun).sum();
}

}  // namespace

void LightOptions::Visit(OptionVisitor& visit) {
  visit("sun_azimuth_deg", sun_azimuth_deg, "of the sun's place, from the x axis towards y");
  visit("sun_elevation_deg", sun_elevation_deg, "height of the sun, degrees");
  visit("overcast", overcast, "0: clear sky; 1: no sun comes through");
  visit("visibility_m", visibility_m, "haze leaves 2 % of the contrast there; 0: clear air");
}

void LightOptions::Validate() const {
  RequireOption(std::isfinite(sun_azimuth_deg), "sun_azimuth_deg", "a finite angle",
                sun_azimuth_deg);
  RequireOption(sun_elevation_deg >= 3 && sun_elevation_deg <= 90, "sun_elevation_deg", "3 to 90",
                sun_elevation_deg);
  RequireOption(overcast >= 0 && overcast <= 1, "overcast", "0 to 1", overcast);
  RequireOption(visibility_m == 0 || (std::isfinite(visibility_m) && visibility_m >= 10),
                "visibility_m", "at least 10, or 0", visibility_m);
}

Light MakeLight(const LightOptions& options) {
  options.Validate();
  Light light;
  const float clear_level = Level(light);
  const double azimuth = options.sun_azimuth_deg * kDegree;
  const double elevation = options.sun_elevation_deg * kDegree;
  light.to_sun = Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                                 std::sin(azimuth) * std::cos(elevation), std::sin(elevation))
                     .cast<float>();
  const float more_air = AirMass(options.sun_elevation_deg) - AirMass(kReferenceElevation_deg);
  const Vector3f through = (-more_air * kOpticalDepth).array().exp();
  light.sun = light.sun.cwiseProduct(through);
  light.horizon = Mix(light.horizon, light.horizon.cwiseProduct(through), 0.3F);
  const auto overcast = static_cast<float>(options.overcast);
  light.sun *= (1 - overcast) * (1 - overcast);
  light.sky = Mix(light.sky, Vector3f::Constant(0.9F), overcast);
  light.zenith = Mix(light.zenith, Vector3f::Constant(0.8F), overcast);
  light.horizon = Mix(light.horizon, Vector3f::Constant(0.75F), overcast);
  const float exposure = clear_level / Level(light);
  light.sun *= exposure;
  light.sky *= exposure;
  if (options.visibility_m > 0) light.visibility_m = static_cast<float>(options.visibility_m);
  return light;
}

Eigen::Vector3f SkyRadiance(const Light& light, const Eigen::Vector3f& direction) {
  const float height = std::clamp(direction.z(), 0.0F, 1.0F);
  return light.zenith + (1 - height) * (light.horizon - light.zenith);
}

float Transmittance(const Light& light, float distance_m) {
  if (std::isinf(light.visibility_m)) return 1;
  return std::exp(-kExtinctionAtVisibility * distance_m / light.visibility_m);
}

}  // namespace mono3d::synthetic
