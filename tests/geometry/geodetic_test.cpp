// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/geodetic.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mono3d {
namespace {

TEST(Geodetic, AMetreNorthAtTheEquatorIsKnownInDegrees) {
  // Radius of the meridian at the equator: a * (1 - e^2) = 6335439.327 m (WGS 84).
  constexpr double kDegreesPerMetre = 180 / (M_PI * 6335439.327);
  const Geodetic place = ToGeodetic({0, 1, 0}, {0, 20, 0});
  EXPECT_NEAR(place.latitude_deg, kDegreesPerMetre, 1e-12);
  EXPECT_NEAR(place.longitude_deg, 20, 1e-12);
  EXPECT_NEAR(place.altitude_m, 0, 1e-6);  // the ellipsoid falls off by 8e-8 m
}

TEST(Geodetic, EastAndUpGoWhereTheySay) {
  // At the equator a degree of longitude is 111319.4908 m.
  const Geodetic place = ToGeodetic({1, 0, 0}, {0, 0, 0});
  EXPECT_NEAR(place.longitude_deg, 1 / 111319.4908, 1e-12);
  EXPECT_NEAR(ToGeodetic({0, 0, 50}, {49, 8, 100}).altitude_m, 150, 1e-6);
}

TEST(Geodetic, ThereAndBackIsTheSamePlace) {
  constexpr double kTolerance_m = 1e-6;  // the promise of the header
  for (const Geodetic& origin :
       {Geodetic{49, 8, 115}, Geodetic{-33, -70, 2000}, Geodetic{88, 179.999, -20}}) {
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(120, -340, 71), Eigen::Vector3d(-9e4, 1e4, 3)}) {
      EXPECT_LT((ToEnu(ToGeodetic(p, origin), origin) - p).norm(), kTolerance_m);
    }
  }
}

}  // namespace
}  // namespace mono3d
