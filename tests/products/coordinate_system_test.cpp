// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/coordinate_system.h"

#include <gtest/gtest.h>

#include "mono3d/core/error.h"
#include "mono3d/products/map_axes.h"

namespace mono3d {
namespace {

constexpr Geodetic kKarlsruhe = {.latitude_deg = 49.01, .longitude_deg = 8.41, .altitude_m = 115};

class CoordinateSystemTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!CoordinateSystem::IsSupported()) GTEST_SKIP() << "built without PROJ";
  }
};

std::string ReasonOf(const std::string& definition, const Geodetic& origin,
                     bool is_altitude_known) {
  try {
    const CoordinateSystem system(definition, origin, is_altitude_known);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(UtmCode, IsOfTheZoneWithItsExceptions) {
  EXPECT_EQ(UtmCodeOf({49, 8.4, 0}), "EPSG:32632");
  EXPECT_EQ(UtmCodeOf({-33.9, 151.2, 0}), "EPSG:32756");
  EXPECT_EQ(UtmCodeOf({46.8, -91.99, 0}), "EPSG:32615");
  EXPECT_EQ(UtmCodeOf({60.4, 5.3, 0}), "EPSG:32632");   // Bergen, in the wide zone
  EXPECT_EQ(UtmCodeOf({78.2, 15.6, 0}), "EPSG:32633");  // Longyearbyen
  EXPECT_EQ(UtmCodeOf({0, 180, 0}), "EPSG:32660");
  EXPECT_EQ(UtmCodeOf({85, 10, 0}), "EPSG:32661");
  EXPECT_EQ(UtmCodeOf({-89, 10, 0}), "EPSG:32761");
}

// By the definition of UTM: 500 km at the central meridian, 0 at the equator, a scale of 0.9996.
TEST_F(CoordinateSystemTest, HasTheDefiningValuesOfUtm) {
  const CoordinateSystem utm("EPSG:32632", {0, 9, 50}, true);
  EXPECT_TRUE(utm.ToMap({0, 0, 0}).isApprox(Eigen::Vector3d(500'000, 0, 50), 1e-12));
  // At 50 m of height a degree is longer than on the ellipsoid.
  const double on_ellipsoid = 0.9996 * 6'378'137.0 / (6'378'137.0 + 50);
  EXPECT_NEAR(utm.ToMap({100, 0, 0}).x() - 500'000, 100 * on_ellipsoid, 1e-5);
  EXPECT_EQ(utm.name(), "WGS 84 / UTM zone 32N");
  EXPECT_NE(utm.wkt2().find("PROJCRS["), std::string::npos);
  EXPECT_EQ(utm.wkt1().find("PROJCS["), 0u);
  EXPECT_FALSE(utm.has_heights());
}

TEST_F(CoordinateSystemTest, PlaceOfIsTheWayBack) {
  const CoordinateSystem utm("EPSG:32632", kKarlsruhe, true);
  const Eigen::Vector3d p_enu_m(120, -340, 25);
  const Geodetic place = CoordinateSystem::PlaceOf("EPSG:32632", utm.ToMap(p_enu_m));
  EXPECT_LT((ToEnu(place, kKarlsruhe) - p_enu_m).norm(), 1e-4);
  const Geodetic same = CoordinateSystem::PlaceOf("EPSG:4979", {8.41, 49.01, 115});
  EXPECT_LT(ToEnu(same, kKarlsruhe).norm(), 1e-4);
  EXPECT_TRUE(CoordinateSystem::IsProjected("EPSG:25832+7837"));
  EXPECT_TRUE(CoordinateSystem::IsProjected("+proj=utm +zone=10 +datum=WGS84 +units=m +type=crs"));
  EXPECT_FALSE(CoordinateSystem::IsProjected("EPSG:4258"));
  EXPECT_THROW((void)CoordinateSystem::IsProjected("EPSG:999999"), Error);
  EXPECT_THROW((void)CoordinateSystem::PlaceOf("EPSG:32632", {1e12, 1e12, 0}), Error);
}

// Expected: gdaltransform -s_srs EPSG:4326 -t_srs ...
TEST_F(CoordinateSystemTest, AgreesWithGdaltransform) {
  const Eigen::Vector3d here = Eigen::Vector3d::Zero();
  const Eigen::Vector3d etrs = CoordinateSystem("EPSG:25832", kKarlsruhe, true).ToMap(here);
  EXPECT_LT((etrs - Eigen::Vector3d(456854.655868, 5428735.116505, 115)).norm(), 1e-4);
  // Its own axes are northing, easting; and it is on another ellipsoid.
  const Eigen::Vector3d gauss = CoordinateSystem("EPSG:31467", kKarlsruhe, true).ToMap(here);
  EXPECT_LT((gauss - Eigen::Vector3d(3456912.811, 5430467.786, 115)).norm(), 3);
  // US survey feet.
  const CoordinateSystem feet("EPSG:2285", {47.6, -122.4, 100}, true);
  EXPECT_NEAR(feet.metres_per_unit(), 1200.0 / 3937, 1e-9);
  EXPECT_LT((feet.ToMap(here) - Eigen::Vector3d(1253922.102, 222795.997, 100)).norm(), 5);
}

// Expected as above. The grid is in Debian's proj-data.
TEST_F(CoordinateSystemTest, BringsHeightsToTheSeaByAGrid) {
  try {
    const CoordinateSystem system("EPSG:32632+5773", kKarlsruhe, true);
    EXPECT_TRUE(system.has_heights());
    EXPECT_NEAR(system.ToMap({0, 0, 0}).z(), 66.81468, 1e-3);
    EXPECT_NEAR(system.ToEnu(system.ToMap({10, 20, 5})).z(), 5, 1e-3);
  } catch (const Error& error) {
    GTEST_SKIP() << error.what();
  }
}

TEST_F(CoordinateSystemTest, ComesBack) {
  for (const char* code : {"EPSG:25832", "EPSG:31467", "EPSG:3857"}) {
    const CoordinateSystem system(code, kKarlsruhe, true);
    const Eigen::Vector3d place(812.25, -377.5, 43.75);
    EXPECT_LT((system.ToEnu(system.ToMap(place)) - place).norm(), 1e-4) << code;
  }
}

TEST_F(CoordinateSystemTest, RefusesWhatIsNoMap) {
  EXPECT_NE(ReasonOf("EPSG:999999", kKarlsruhe, true).find("a code that PROJ knows"),
            std::string::npos);
  EXPECT_NE(ReasonOf("nonsense", kKarlsruhe, true).find("a code that PROJ knows"),
            std::string::npos);
  EXPECT_NE(ReasonOf("EPSG:4326", kKarlsruhe, true).find("a projected one"), std::string::npos);
  EXPECT_NE(ReasonOf("EPSG:25832+5773", kKarlsruhe, false).find("one without heights"),
            std::string::npos);
  EXPECT_EQ(ReasonOf("EPSG:25832", kKarlsruhe, false), "none");
}

TEST_F(CoordinateSystemTest, IsAffineNearAPlace) {
  const MapAxes axes(CoordinateSystem("EPSG:25832", kKarlsruhe, true));
  const Eigen::Vector3d centre(1000, -2000, 30);
  const AffineMap to_map = axes.ToMapNear(centre);
  const AffineMap to_model = axes.ToModelNear(axes.ToMap(centre));
  const Eigen::Vector3d off = Eigen::Vector3d(1, -1, 0.5) * MapAxes::kCell / 2;
  EXPECT_LT((to_map(centre + off) - axes.ToMap(centre + off)).norm(), 1e-4);
  EXPECT_LT((to_model(axes.ToMap(centre + off)) - (centre + off)).norm(), 1e-4);
}

TEST(MapAxesOfRun, AreThoseOfTheModelWithoutPositions) {
  FinishedRun run;
  const MapAxes axes = AxesOfProducts(run, "");
  EXPECT_EQ(axes.system(), nullptr);
  EXPECT_EQ(axes.ToMap({1, 2, 3}), Eigen::Vector3d(1, 2, 3));
  EXPECT_NE(AxesLine(run, axes).find("no positions"), std::string::npos);
  EXPECT_THROW(AxesOfProducts(run, "EPSG:25832"), UsageError);
}

}  // namespace
}  // namespace mono3d
