// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/furniture.h"

#include <Eigen/Geometry>
#include <cmath>

namespace mono3d::synthetic {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPoleHeight_m = 8.5F;
constexpr float kWire_m = 0.05F;
const Finish kTimber{Material::kWood, Vector3f(0.2F, 0.15F, 0.11F), 11};
const Finish kMetal{Material::kPaint, Vector3f(0.2F, 0.21F, 0.22F), 0};
const Finish kCable{Material::kPaint, Vector3f(0.05F, 0.05F, 0.05F), 0};

// Every so many points of a street, at this distance to its left (right where negative).
struct Spacing {
  std::size_t points;
  float aside_m;
};

struct Stand {
  Vector2f place;
  Vector2f along;
};

std::vector<Stand> StandsAlong(const Site& site, const Polyline& street, const Spacing& spacing) {
  std::vector<Stand> stands;
  for (std::size_t i = 1; i + 1 < street.size(); i += spacing.points) {
    const Vector2f along = (street[i + 1] - street[i - 1]).normalized();
    const Vector2f place = street[i] + spacing.aside_m * Left(along);
    // Not on a street that crosses, nor in the water.
    if (site.ground.streets.At(place) < 0.9F * std::abs(spacing.aside_m)) continue;
    if (!site.IsFree({place, 0.3F})) continue;
    stands.push_back({place, along});
  }
  return stands;
}

// A wire hangs in a parabola.
void AddWire(Mesh& mesh, const Vector3f& from, const Vector3f& to) {
  constexpr int kPieces = 8;
  constexpr float kSag_m = 0.7F;
  const auto at = [&](int i) {
    const float t = static_cast<float>(i) / kPieces;
    return Vector3f(from + t * (to - from) - 4 * kSag_m * t * (1 - t) * Vector3f::UnitZ());
  };
  for (int i = 0; i < kPieces; ++i) AddRod(mesh, {at(i), at(i + 1), kWire_m}, kCable);
}

}  // namespace

void AddRod(Mesh& mesh, const Rod& rod, const Finish& finish) {
  const Vector3f along = rod.to - rod.from;
  const Vector3f aside = rod.thickness_m * along.unitOrthogonal();
  const Vector3f other = rod.thickness_m * along.cross(aside).normalized();
  AddBlock(mesh, {rod.from - (aside + other) / 2, along, aside, other}, finish);
}

void AddPolesWithWires(Site& site, const Polyline& street) {
  constexpr Spacing kPoles{5, -4.7F};
  constexpr float kLongestSpan_m = 45;
  const Vector3f up = Vector3f::UnitZ();
  const std::vector<Stand> stands = StandsAlong(site, street, kPoles);
  for (std::size_t i = 0; i < stands.size(); ++i) {
    const Vector3f base = site.At(stands[i].place);
    const Vector3f across = Horizontal(Left(stands[i].along));
    const Vector3f top = base + kPoleHeight_m * up;
    AddRod(site.mesh, {base - 0.5F * up, top, 0.2F}, kTimber);
    AddRod(site.mesh, {top - 0.4F * up - 0.9F * across, top - 0.4F * up + 0.9F * across, 0.12F},
           kTimber);
    if (i == 0 || (stands[i].place - stands[i - 1].place).norm() > kLongestSpan_m) continue;
    const Vector3f before = site.At(stands[i - 1].place) + kPoleHeight_m * up;
    const Vector3f across_before = Horizontal(Left(stands[i - 1].along));
    for (const float side : {-0.8F, 0.0F, 0.8F}) {
      AddWire(site.mesh, before - 0.3F * up + side * across_before,
              top - 0.3F * up + side * across);
    }
  }
}

void AddStreetLamps(Site& site, const Polyline& street) {
  constexpr Spacing kLamps{4, 4.4F};
  constexpr float kHeight_m = 6;
  const Vector3f up = Vector3f::UnitZ();
  for (const Stand& stand : StandsAlong(site, street, kLamps)) {
    const Vector3f base = site.At(stand.place);
    const Vector3f top = base + kHeight_m * up;
    const Vector3f to_street = -Horizontal(Left(stand.along));
    AddRod(site.mesh, {base - 0.5F * up, top, 0.12F}, kMetal);
    AddRod(site.mesh, {top, top + 1.6F * to_street + 0.3F * up, 0.08F}, kMetal);
    AddBlock(site.mesh,
             CentredBlock(top + 1.8F * to_street + 0.3F * up, 0.7F * to_street,
                          0.3F * Horizontal(Left(Vector2f(to_street.head<2>()))), 0.15F * up),
             kMetal);
  }
}

void AddFence(Site& site, const Vector2f& from, const Vector2f& to) {
  constexpr float kPost_m = 2;
  const Vector3f up = Vector3f::UnitZ();
  const int num_fields = std::max(1, static_cast<int>((to - from).norm() / kPost_m));
  const auto at = [&](int i) {
    return site.At(from + static_cast<float>(i) / static_cast<float>(num_fields) * (to - from));
  };
  for (int i = 0; i <= num_fields; ++i) {
    AddRod(site.mesh, {at(i) - 0.3F * up, at(i) + 1.15F * up, 0.1F}, kTimber);
    if (i == num_fields) break;
    for (const float height_m : {0.45F, 0.95F}) {
      AddRod(site.mesh, {at(i) + height_m * up, at(i + 1) + height_m * up, 0.06F}, kTimber);
    }
  }
}

void AddFences(Site& site, const Polyline& street) {
  for (const float aside_m : {-6.3F, 6.3F}) {
    const std::vector<Stand> stands = StandsAlong(site, street, {2, aside_m});
    for (std::size_t i = 1; i < stands.size(); ++i) {
      const Vector2f& from = stands[i - 1].place;
      const Vector2f& to = stands[i].place;
      if ((to - from).norm() > 16 || site.random.Chance(0.45)) continue;
      if (site.ground.paths.At((from + to) / 2) < 4) continue;
      AddFence(site, from, to);
    }
  }
}

}  // namespace mono3d::synthetic
