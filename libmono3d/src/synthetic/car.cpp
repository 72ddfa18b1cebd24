// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/car.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

namespace mono3d::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Places at equal steps along a street, on the ground.
struct Route {
  static constexpr float kStep_m = 2;
  std::vector<Vector3f> places;

  float Length() const { return kStep_m * static_cast<float>(places.size() - 1); }
  Vector3f At(float s_m) const {
    const float place = std::clamp(s_m / kStep_m, 0.0F, static_cast<float>(places.size()) - 1.001F);
    const auto i = static_cast<std::size_t>(place);
    return places[i] + (place - static_cast<float>(i)) * (places[i + 1] - places[i]);
  }
};

Route RouteAlong(const Site& site, const Polyline& street) {
  Route route;
  float left_over_m = 0;
  for (std::size_t i = 1; i < street.size(); ++i) {
    const Vector2f piece = street[i] - street[i - 1];
    for (; left_over_m < piece.norm(); left_over_m += Route::kStep_m) {
      route.places.push_back(site.At(street[i - 1] + left_over_m * piece.normalized()));
    }
    left_over_m -= piece.norm();
  }
  return route;
}

// On the ground at both axles, its x axis ahead.
Eigen::Isometry3f PoseOn(const Route& route, float s_m) {
  constexpr float kHalfWheelbase_m = 1.3F;
  const Vector3f front = route.At(s_m + kHalfWheelbase_m);
  const Vector3f rear = route.At(s_m - kHalfWheelbase_m);
  const Vector3f x = (front - rear).normalized();
  const Vector3f y = Vector3f::UnitZ().cross(x).normalized();
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  pose.linear() << x, y, x.cross(y);
  pose.translation() = (front + rear) / 2;
  return pose;
}

}  // namespace

void AddCar(Mesh& mesh, const CarPlace& place, RandomNumbers& random) {
  const Vector3f& x = place.ahead;
  const Vector3f z = Vector3f::UnitZ();
  const Vector3f y = z.cross(x);
  const Vector3f& base = place.base;
  // As on a car park: mostly grey, now and then a colour.
  static constexpr std::array<std::array<float, 3>, 8> kPaints = {{{0.62F, 0.62F, 0.6F},
                                                                   {0.3F, 0.31F, 0.33F},
                                                                   {0.05F, 0.05F, 0.055F},
                                                                   {0.12F, 0.125F, 0.13F},
                                                                   {0.4F, 0.05F, 0.04F},
                                                                   {0.06F, 0.12F, 0.3F},
                                                                   {0.1F, 0.2F, 0.13F},
                                                                   {0.45F, 0.38F, 0.24F}}};
  const auto& colour = kPaints[random.Bits() % kPaints.size()];
  const auto bright = static_cast<float>(random.Uniform(0.8, 1.2));
  const Finish paint{Material::kPaint, bright * Vector3f(colour[0], colour[1], colour[2]), 0};
  const Finish glass{Material::kGlass, Vector3f(0.05F, 0.06F, 0.07F), random.Bits()};
  const Finish tyre{Material::kPaint, Vector3f::Constant(0.03F), 0};
  for (const float along : {-1.35F, 1.35F}) {
    AddBlock(mesh, CentredBlock(base + 0.3F * z + along * x, 0.65F * x, 1.7F * y, 0.6F * z), tyre);
  }
  AddBlock(mesh, CentredBlock(base + 0.6F * z, 4.3F * x, 1.75F * y, 0.55F * z), paint);
  AddBlock(mesh, CentredBlock(base + 1.1F * z - 0.2F * x, 2.3F * x, 1.5F * y, 0.5F * z), glass);
  AddBlock(mesh, CentredBlock(base + 1.38F * z - 0.2F * x, 2.1F * x, 1.52F * y, 0.08F * z), paint);
  const Finish lamp{Material::kPaint, Vector3f(0.8F, 0.75F, 0.6F), 0};
  const Finish rear_lamp{Material::kPaint, Vector3f(0.5F, 0.03F, 0.02F), 0};
  AddBlock(mesh, CentredBlock(base + 0.68F * z + 2.15F * x, 0.06F * x, 1.5F * y, 0.14F * z), lamp);
  AddBlock(mesh, CentredBlock(base + 0.7F * z - 2.15F * x, 0.06F * x, 1.55F * y, 0.14F * z),
           rear_lamp);
}

void AddParkedCars(Site& site, double share) {
  for (const Polyline& street : site.streets) {
    for (std::size_t i = 1; i + 1 < street.size(); ++i) {
      if (!site.random.Chance(share)) continue;
      const Vector2f along = (street[i + 1] - street[i - 1]).normalized();
      const float side = site.random.Chance(0.5) ? 1.0F : -1.0F;
      const Vector2f place = street[i] + side * 1.8F * Left(along);
      // Neither on a crossing nor on a bridge.
      if (site.ground.streets.At(place) < 1.6F || IsAtWater(site.ground, place, 12)) continue;
      AddCar(site.mesh, {site.At(place), Horizontal(along)}, site.random);
    }
  }
}

void AddDrivingCars(Site& site, int num_cars) {
  if (site.routes.empty()) return;
  std::vector<std::shared_ptr<const Route>> routes;
  for (const Polyline& street : site.routes) {
    routes.push_back(std::make_shared<const Route>(RouteAlong(site, street)));
  }
  for (int i = 0; i < num_cars; ++i) {
    const auto route = routes[static_cast<std::size_t>(i) % routes.size()];
    // Each street has one speed, so that no car runs into another.
    const float speed_m_s =
        6 + 5 * HashUnit(i % static_cast<int>(routes.size()), 0, 0, site.ground.seed);
    const int round = i / static_cast<int>(routes.size());
    const int num_rounds = 1 + num_cars / static_cast<int>(routes.size());
    const float start_m = route->Length() * (static_cast<float>(round) + site.Random(0.2, 0.8)) /
                          static_cast<float>(num_rounds);
    MovingObject car;
    AddCar(car.mesh, {Vector3f::Zero(), Vector3f::UnitX()}, site.random);
    car.T_world_object = [route, speed_m_s, start_m](double t_s) {
      const double way_m = start_m + speed_m_s * t_s;
      const double length_m = route->Length();
      return PoseOn(*route, static_cast<float>(way_m - length_m * std::floor(way_m / length_m)));
    };
    site.moving.push_back(std::move(car));
  }
}

}  // namespace mono3d::synthetic
