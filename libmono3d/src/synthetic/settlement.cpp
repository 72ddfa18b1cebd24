// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/settlement.h"

#include <cmath>
#include <numbers>

#include "synthetic/planting.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPlotRadius_m = 8.2F;

// Vegetable beds and a hedge behind the house.
void AddGarden(Site& site, const PlacedHouse& placed) {
  const Vector2f away = (placed.middle - placed.at_street).normalized();
  const Vector2f aside(-away.y(), away.x());
  const Vector2f behind = placed.middle + 11 * away;
  if (site.random.Chance(0.6)) {
    AddHedge(site, behind - 9 * aside + 3 * away, behind + 9 * aside + 3 * away);
    AddHedge(site, placed.middle - 9 * aside - 5 * away, behind - 9 * aside + 3 * away);
  }
  for (int i = 0; i < 3; ++i) {
    if (!site.random.Chance(0.55)) continue;
    const Vector2f middle = behind + (4.5F * static_cast<float>(i) - 4.5F) * aside;
    if (IsAtWater(site.ground, middle, 3)) continue;
    AddBlock(site.mesh,
             CentredBlock(site.At(middle), 3.2F * Horizontal(aside), 4 * Horizontal(Left(aside)),
                          0.7F * Vector3f::UnitZ()),
             {Material::kSoil, Vector3f(0.15F, 0.1F, 0.065F), site.random.Bits()});
  }
}

}  // namespace

std::vector<PlacedHouse> PlaceHouses(Site& site, float reach_m, double share) {
  constexpr float kPi = std::numbers::pi_v<float>;
  std::vector<PlacedHouse> placed;
  for (const Polyline& street : site.streets) {
    for (std::size_t i = 1; i + 1 < street.size(); ++i) {
      const Vector2f along = (street[i + 1] - street[i - 1]).normalized();
      for (const float side : {-1.0F, 1.0F}) {
        const Vector2f aside = side * Vector2f(-along.y(), along.x());
        const Vector2f middle = street[i] + site.Random(11.5, 15) * aside;
        if (middle.norm() > reach_m || !site.IsFree({middle, kPlotRadius_m})) continue;
        if (share < 1 && !site.random.Chance(share)) continue;
        PlacedHouse house{RandomHouse(site.random), middle, street[i]};
        const float turn = site.random.Chance(0.3) ? kPi / 2 : 0;
        house.house.yaw_rad = std::atan2(along.y(), along.x()) + turn + site.Random(-0.08, 0.08);
        if (side < 0) house.house.yaw_rad += kPi;
        site.plots.push_back({middle, kPlotRadius_m});
        placed.push_back(house);
      }
    }
  }
  return placed;
}

std::vector<Polyline> Drives(const std::vector<PlacedHouse>& houses) {
  std::vector<Polyline> drives;
  for (const PlacedHouse& placed : houses) drives.push_back({placed.at_street, placed.middle});
  return drives;
}

void AddHouses(Site& site, const std::vector<PlacedHouse>& houses) {
  for (const PlacedHouse& placed : houses) {
    HouseOptions house = placed.house;
    house.base = site.At(placed.middle) + 0.3F * Vector3f::UnitZ();
    AddHouse(site.mesh, house, site.random);
    AddGarden(site, placed);
  }
}

}  // namespace mono3d::synthetic
