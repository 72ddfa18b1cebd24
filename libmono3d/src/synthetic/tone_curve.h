// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>

namespace mono3d::synthetic {

// From linear light to grey value, both 0 to 1.
//   gamma    the root of 2.2
//   linear   the light itself
//   srgb     that of IEC 61966-2-1: a short straight line, then about the root of 2.4
//   s_curve  sRGB, then more contrast in the middle and less at both ends, as phones and drones
//            have it
inline constexpr std::array<const char*, 4> kToneCurves = {"gamma", "linear", "srgb", "s_curve"};

class ToneCurve {
 public:
  // `contrast`, 0 to 1, is of the S curve: 0 is sRGB; at 1 the middle has one and a half of its
  // slope and both ends have none. Throws Error on another kind.
  ToneCurve(const std::string& kind, double contrast);

  // The same value on any thread. `level` is 0 to 1.
  float operator()(float level) const;

 private:
  enum class Kind { kGamma, kLinear, kSrgb, kSCurve };
  Kind kind_;
  float contrast_;
};

}  // namespace mono3d::synthetic
