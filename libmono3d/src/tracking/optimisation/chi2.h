// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d::tracking {

// Quantiles of the chi-squared distribution: a squared error over its variance beyond one of them
// is an outlier. At 95 %, by the number of dimensions of the error:
inline constexpr double kChi2OneDof = 3.841;
inline constexpr double kChi2TwoDof = 5.991;
inline constexpr double kChi2ThreeDof = 7.815;
inline constexpr double kChi2SixDof = 12.592;
inline constexpr double kChi2SevenDof = 14.067;
// At 99.99 %.
inline constexpr double kChi2TwoDofSure = 18.421;
inline constexpr double kChi2ThreeDofSure = 21.108;
// At 99.9 %.
inline constexpr double kChi2SevenDofSure = 24.322;

}  // namespace mono3d::tracking
