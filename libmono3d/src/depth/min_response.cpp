// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/min_response.h"

#include <algorithm>

namespace mono3d {

double MinResponse(const DogOptions& options, const ImageNoise& noise) {
  // Grey levels. Cameras have less; what measures as more is fine texture all over the image.
  constexpr double kMaxNoise = 5;
  return options.min_response * std::clamp(noise.flat, 1.0, kMaxNoise);
}

}  // namespace mono3d
