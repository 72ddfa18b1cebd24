// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/tone_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

constexpr float kGamma = 2.2F;

float SrgbOf(float level) {
  constexpr float kEndOfLine = 0.0031308F;
  return level <= kEndOfLine ? 12.92F * level : 1.055F * std::pow(level, 1 / 2.4F) - 0.055F;
}

// The cubic from (0, 0) to (1, 1) without slope at both ends.
float WithContrast(float v) { return v * v * (3 - 2 * v); }

}  // namespace

ToneCurve::ToneCurve(const std::string& kind, double contrast)
    : contrast_(static_cast<float>(contrast)) {
  const auto found = std::find(kToneCurves.begin(), kToneCurves.end(), kind);
  if (found == kToneCurves.end()) throw Error("no such tone curve: " + kind);
  constexpr std::array<Kind, 4> kKinds = {Kind::kGamma, Kind::kLinear, Kind::kSrgb, Kind::kSCurve};
  kind_ = kKinds[static_cast<std::size_t>(found - kToneCurves.begin())];
}

float ToneCurve::operator()(float level) const {
  switch (kind_) {
    case Kind::kGamma:
      return std::pow(level, 1 / kGamma);
    case Kind::kLinear:
      return level;
    case Kind::kSrgb:
      return SrgbOf(level);
    case Kind::kSCurve: {
      const float grey = SrgbOf(level);
      return grey + contrast_ * (WithContrast(grey) - grey);
    }
  }
  return level;
}

}  // namespace mono3d::synthetic
