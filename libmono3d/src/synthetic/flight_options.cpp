// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight_options.h"

#include <algorithm>
#include <cmath>

#include "mono3d/core/error.h"
#include "synthetic/smooth_way.h"

namespace mono3d::synthetic {
namespace {

void RequireAboveZero(const char* option, double value) {
  RequireOption(std::isfinite(value) && value > 0, option, "above 0", value);
}

void RequireAtLeastZero(const char* option, double value) {
  RequireOption(std::isfinite(value) && value >= 0, option, "at least 0", value);
}

void RequireFinite(const char* option, double value) {
  RequireOption(std::isfinite(value), option, "a finite number", value);
}

void RequireKind(const std::string& kind) {
  if (std::find(kFlightKinds.begin(), kFlightKinds.end(), kind) != kFlightKinds.end()) return;
  std::string kinds;
  for (const char* known : kFlightKinds) kinds += (kinds.empty() ? "" : ", ") + std::string(known);
  throw UsageError(ErrorParts{
      .what = "unknown flight", .where = "--flight.kind", .expected = kinds, .found = kind});
}

}  // namespace

void UnsteadinessOptions::Visit(OptionVisitor& visit) {
  visit("position_m", position_m, "standard deviation of the position, metres");
  visit("rotation_deg", rotation_deg, "standard deviation of the rotation, degrees");
  visit("lowest_hz", lowest_hz, "slowest swings");
  visit("highest_hz", highest_hz, "fastest swings");
  visit("seed", seed, "seed of the swings");
}

void UnsteadinessOptions::Validate() const {
  RequireAtLeastZero("flight.unsteadiness.position_m", position_m);
  RequireAtLeastZero("flight.unsteadiness.rotation_deg", rotation_deg);
  RequireAtLeastZero("flight.unsteadiness.lowest_hz", lowest_hz);
  RequireOption(std::isfinite(highest_hz) && highest_hz >= lowest_hz,
                "flight.unsteadiness.highest_hz", "at least lowest_hz", highest_hz);
}

void FlightOptions::Visit(OptionVisitor& visit) {
  visit("kind", kind,
        "orbit, lawnmower, cruise, lateral, take_off, stop_and_turn, rocket, dronie, helix");
  visit("target_x_m", target_x_m, "what the flight is about, x, metres");
  visit("target_y_m", target_y_m, "what the flight is about, y, metres");
  visit("height_m", height_m, "height above the ground, metres");
  visit("speed_m_per_s", speed_m_per_s, "speed once under way, metres per second");
  visit("duration_s", duration_s, "from standstill to standstill, seconds");
  visit("ramp_s", ramp_s, "that speeding up and slowing down take, seconds");
  visit("heading_deg", heading_deg, "direction of the flight, degrees from x towards y");
  visit("pitch_deg", pitch_deg,
        "of the view below the horizon, degrees; not of what looks at its target");
  visit("radius_m", radius_m,
        "orbit: radius of the circle; dronie, helix: distance on the ground at the end, metres");
  visit("start_deg", start_deg, "orbit, helix: where on the circle it starts, degrees");
  visit("full_circle", full_circle, "orbit: once round; the duration follows");
  visit("row_length_m", row_length_m, "lawnmower: length of a row, metres");
  visit("row_spacing_m", row_spacing_m, "lawnmower: from row to row, metres");
  visit("take_off_height_m", take_off_height_m,
        "take_off, rocket, dronie, helix: where the climb begins, metres");
  visit("turn_deg", turn_deg, "stop_and_turn: turn in place, left positive, degrees");
  visit("turn_deg_per_s", turn_deg_per_s, "stop_and_turn: yaw rate, degrees per second");
  visit("sideways_s", sideways_s, "stop_and_turn: begin with so long a flight to the right");
  visit("arm_m", arm_m, "stop_and_turn: from the axis of yaw to the camera ahead, metres");
  visit("hover_s", hover_s, "stop_and_turn: standstill before the turn, seconds");
  visit("climb_deg", climb_deg, "stop_and_turn: climb of the path after the turn, degrees");
  visit.Group("unsteadiness", unsteadiness);
}

void FlightOptions::Validate() const {
  RequireKind(kind);
  RequireFinite("flight.target_x_m", target_x_m);
  RequireFinite("flight.target_y_m", target_y_m);
  RequireAboveZero("flight.height_m", height_m);
  RequireAboveZero("flight.speed_m_per_s", speed_m_per_s);
  RequireAboveZero("flight.ramp_s", ramp_s);
  RequireOption(std::isfinite(duration_s) && duration_s > 2 * ramp_s, "flight.duration_s",
                "more than twice ramp_s", duration_s);
  RequireFinite("flight.heading_deg", heading_deg);
  RequireOption(pitch_deg >= 0 && pitch_deg <= 90, "flight.pitch_deg", "0 to 90", pitch_deg);
  RequireAboveZero("flight.radius_m", radius_m);
  RequireFinite("flight.start_deg", start_deg);
  RequireAboveZero("flight.row_length_m", row_length_m);
  RequireAboveZero("flight.row_spacing_m", row_spacing_m);
  RequireAboveZero("flight.take_off_height_m", take_off_height_m);
  const bool climbs = kind == "take_off" || kind == "rocket" || kind == "dronie" || kind == "helix";
  RequireOption(!climbs || take_off_height_m < height_m, "flight.take_off_height_m",
                "below height_m", take_off_height_m);
  RequireFinite("flight.turn_deg", turn_deg);
  RequireAboveZero("flight.turn_deg_per_s", turn_deg_per_s);
  RequireAtLeastZero("flight.arm_m", arm_m);
  RequireAtLeastZero("flight.hover_s", hover_s);
  RequireOption(sideways_s == 0 || sideways_s > ramp_s, "flight.sideways_s", "0 or above ramp_s",
                sideways_s);
  RequireOption(std::abs(climb_deg) <= 90, "flight.climb_deg", "-90 to 90", climb_deg);
  unsteadiness.Validate();
  if (kind != "stop_and_turn") return;
  const double turn_s = SmoothWay(std::abs(turn_deg), turn_deg_per_s, ramp_s).duration_s();
  const double first_s = sideways_s > 0 ? sideways_s + ramp_s : 3 * ramp_s;
  RequireOption(duration_s > first_s + hover_s + turn_s + ramp_s, "flight.duration_s",
                "long enough for the turn and two cruises", duration_s);
}

}  // namespace mono3d::synthetic
