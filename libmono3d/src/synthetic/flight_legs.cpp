// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight_legs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "synthetic/numbers.h"
#include "synthetic/smooth_way.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

double SmoothStep(double x) { return x * x * (3 - 2 * x); }

// The distance that is flown in `duration_s` from rest to rest.
double DistanceIn(double duration_s, const FlightOptions& options) {
  return options.speed_m_per_s * (duration_s - options.ramp_s);
}

SmoothWay WayOf(double distance_m, const FlightOptions& options) {
  return {distance_m, options.speed_m_per_s, options.ramp_s};
}

Leg Orbit(const FlightOptions& options) {
  const double radius_m = options.radius_m;
  const double circle_m = 2 * pi * radius_m;
  const double distance_m =
      options.full_circle ? circle_m : DistanceIn(options.duration_s, options);
  const SmoothWay way = WayOf(distance_m, options);
  const double start_rad = Radians(options.start_deg);
  const double height_m = options.height_m;
  const auto aim = [=](double t_s) {
    const double angle = start_rad + way.At(t_s) / radius_m;
    return Aim{{radius_m * std::cos(angle), radius_m * std::sin(angle), height_m},
               angle + pi,
               std::atan2(height_m, radius_m)};
  };
  return {way.duration_s(), aim};
}

// Straight on from `from`, for a time; `course_rad` is the path against where it looks, left
// positive, `climb_rad` the path above the horizon.
Leg Straight(const FlightOptions& options, const Aim& from, double duration_s,
             double course_rad = 0, double climb_rad = 0) {
  const SmoothWay way = WayOf(DistanceIn(duration_s, options), options);
  const double course = from.yaw_rad + course_rad;
  const Vector3d path(std::cos(climb_rad) * std::cos(course),
                      std::cos(climb_rad) * std::sin(course), std::sin(climb_rad));
  const auto aim = [=](double t_s) {
    Aim now = from;
    now.eye += way.At(t_s) * path;
    return now;
  };
  return {way.duration_s(), aim};
}

// Rows along x, each to the left of the one before, joined by half circles. The camera yaws through
// a turn with a smooth rate.
Leg Lawnmower(const FlightOptions& options) {
  const double row_m = options.row_length_m;
  const double radius_m = options.row_spacing_m / 2;
  const double turn_m = pi * radius_m;
  const double height_m = options.height_m;
  const double pitch_rad = Radians(options.pitch_deg);
  const SmoothWay way = WayOf(DistanceIn(options.duration_s, options), options);
  const auto aim = [=](double t_s) {
    const double s = way.At(t_s);
    const double row = std::floor(s / (row_m + turn_m));
    const double along_m = s - row * (row_m + turn_m);
    const double turned = std::max(along_m - row_m, 0.0) / turn_m;  // 0 to 1
    double x = std::min(along_m, row_m) + radius_m * std::sin(pi * turned);
    const double y = 2 * radius_m * row + radius_m * (1 - std::cos(pi * turned));
    double yaw = pi * SmoothStep(turned);
    if (std::fmod(row, 2) != 0) {
      x = row_m - x;
      yaw = pi - yaw;
    }
    return Aim{{x, y, height_m}, yaw, pitch_rad};
  };
  return {way.duration_s(), aim};
}

// Along x; the view may be turned against the flight.
Legs StraightFlight(const FlightOptions& options, double view_rad) {
  const Aim start{{0, 0, options.height_m}, view_rad, Radians(options.pitch_deg)};
  return {Straight(options, start, options.duration_s, -view_rad)};
}

// A climb, then a cruise for what is left of the time.
Legs TakeOff(const FlightOptions& options) {
  const double low_m = options.take_off_height_m;
  const double climb_m =
      std::min(options.height_m - low_m, DistanceIn(options.duration_s, options));
  const SmoothWay way = WayOf(climb_m, options);
  const double pitch_rad = Radians(options.pitch_deg);
  const auto climb = [=](double t_s) {
    const double z = way.At(t_s);
    return Aim{{0, 0, low_m + z}, 0, pitch_rad * z / climb_m};
  };
  Legs legs = {{way.duration_s(), climb}};
  const double rest_s = options.duration_s - way.duration_s();
  if (rest_s > 2 * options.ramp_s) {
    legs.push_back(Straight(options, climb(way.duration_s()), rest_s));
  }
  return legs;
}

// From take_off_height_m towards height_m on the surface of a cone with its apex in the target, at
// which it looks; `turns_rad_per_m` around the target for each metre of height.
Leg AwayFromTarget(const FlightOptions& options, double radius_m, double turns_rad_per_m) {
  const double low_m = options.take_off_height_m;
  const double radius_per_m = radius_m / options.height_m;  // of height
  // Length of the way for each metre of height, that of a helix at its middle radius.
  const double middle_m = radius_per_m * (low_m + options.height_m) / 2;
  const double way_per_m = std::hypot(1, radius_per_m, turns_rad_per_m * middle_m);
  const double way_m =
      std::min((options.height_m - low_m) * way_per_m, DistanceIn(options.duration_s, options));
  const SmoothWay way = WayOf(way_m, options);
  const double start_rad = turns_rad_per_m == 0 ? pi : Radians(options.start_deg);
  const double pitch_rad = std::atan2(options.height_m, radius_m);
  const auto aim = [=](double t_s) {
    const double climbed_m = way.At(t_s) / way_per_m;
    const double z = low_m + climbed_m;
    const double angle = start_rad + turns_rad_per_m * climbed_m;
    return Aim{{radius_per_m * z * std::cos(angle), radius_per_m * z * std::sin(angle), z},
               angle + pi,
               pitch_rad};
  };
  return {options.duration_s, aim};
}

// Once around the target on its way, whatever the height.
Leg Helix(const FlightOptions& options) {
  return AwayFromTarget(options, options.radius_m,
                        2 * pi / (options.height_m - options.take_off_height_m));
}

Legs StopAndTurn(const FlightOptions& options) {
  const double turn_rad = Radians(options.turn_deg);
  const SmoothWay turn(std::abs(turn_rad), Radians(options.turn_deg_per_s), options.ramp_s);
  const double cruise_s = (options.duration_s - turn.duration_s() - options.hover_s) / 2;
  const bool is_sideways = options.sideways_s > 0;
  const double first_s = is_sideways ? options.sideways_s : cruise_s;
  const Aim start{{0, 0, options.height_m}, 0, Radians(options.pitch_deg)};
  Legs legs = {Straight(options, start, first_s, is_sideways ? -pi / 2 : 0)};
  const Aim stop = legs[0].aim(first_s);
  const double hover_s = options.hover_s;
  const double sign = turn_rad < 0 ? -1 : 1;
  const double arm_m = options.arm_m;
  const auto aim = [=](double t_s) {
    const double yaw = stop.yaw_rad + sign * turn.At(std::max(t_s - hover_s, 0.0));
    const Vector3d arm(std::cos(yaw) - std::cos(stop.yaw_rad),
                       std::sin(yaw) - std::sin(stop.yaw_rad), 0);
    return Aim{stop.eye + arm_m * arm, yaw, stop.pitch_rad};
  };
  const double standing_s = hover_s + turn.duration_s();
  legs.push_back({standing_s, aim});
  legs.push_back(Straight(options, aim(standing_s), options.duration_s - first_s - standing_s, 0,
                          Radians(options.climb_deg)));
  return legs;
}

}  // namespace

Legs LegsOf(const FlightOptions& options) {
  if (options.kind == "lawnmower") return {Lawnmower(options)};
  if (options.kind == "cruise") return StraightFlight(options, 0);
  if (options.kind == "lateral") return StraightFlight(options, pi / 2);
  if (options.kind == "take_off") return TakeOff(options);
  if (options.kind == "stop_and_turn") return StopAndTurn(options);
  if (options.kind == "rocket") return {AwayFromTarget(options, 0, 0)};
  if (options.kind == "dronie") return {AwayFromTarget(options, options.radius_m, 0)};
  if (options.kind == "helix") return {Helix(options)};
  return {Orbit(options)};
}

double Duration(const Legs& legs) {
  double duration_s = 0;
  for (const Leg& leg : legs) duration_s += leg.duration_s;
  return duration_s;
}

Aim AimAt(const Legs& legs, double t_s) {
  for (const Leg& leg : legs) {
    if (t_s < leg.duration_s) return leg.aim(std::max(t_s, 0.0));
    t_s -= leg.duration_s;
  }
  return legs.back().aim(legs.back().duration_s);
}

}  // namespace mono3d::synthetic
