// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/geo/ground_control_file.h"
#include "mono3d/geo/position_file.h"

namespace mono3d::fuzz {
namespace {

bool IsPlace(const PositionFix& fix) {
  return std::isfinite(fix.time_s) && std::abs(fix.latitude_deg) <= 90 &&
         std::abs(fix.longitude_deg) <= 180 &&
         std::isfinite(fix.altitude_m.value_or(0) + fix.height_m.value_or(0)) &&
         std::isfinite(fix.sigma_horizontal_m + fix.sigma_vertical_m);
}

bool IsSurveyed(const SurveyedPoint& point) {
  return !point.name.empty() && !point.marks.empty() &&
         std::isfinite(point.x + point.y + point.z.value_or(0)) &&
         std::ranges::all_of(point.marks, [](const ControlMark& mark) {
           return mark.pixel.allFinite() && !mark.image.empty();
         });
}

}  // namespace

// The content decides on the form.
void Positions(std::string_view input) {
  static const InputFolder folder("positions");
  const auto file = folder.Write("positions.txt", input);
  const auto control = ReadOrRefuse([&] { return ReadGroundControlFile(file); });
  if (control && !std::ranges::all_of(control->points, IsSurveyed)) {
    throw std::logic_error("ground control points that are none");
  }
  const auto track = ReadOrRefuse([&] { return ReadPositionFile(file); });
  if (!track) return;
  if (track->fixes.empty() || !std::ranges::all_of(track->fixes, IsPlace) ||
      (track->clock != PositionClock::kImages &&
       !std::ranges::is_sorted(track->fixes, {}, &PositionFix::time_s))) {
    throw std::logic_error("positions that are none, or not in order of their times");
  }
}

}  // namespace mono3d::fuzz
