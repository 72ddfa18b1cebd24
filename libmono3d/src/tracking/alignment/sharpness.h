// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "tracking/alignment/octaves.h"

namespace mono3d::tracking {

// How much fine detail an image shows for its coarse detail: half the logarithm of the mean squared
// gradient of the image over that of its second halving. Brightness and contrast cancel; motion
// blur and defocus lower it, by about .1 for each pixel of motion while the shutter is open. Of
// one scene and camera it says which of two images is sharper, of different ones nothing. 0 for an
// image too small for halvings, or without any gradient.
double LogSharpness(const Octaves& octaves);

// How sharp an image is among those before it that show the same. In images without blur the
// sharpness follows what is in view, slowly: by .013 at most within twenty images (deviation from a
// straight line; rendered flights, a drone's video), in blurred ones by .04 to .14.
class SharpnessHistory {
 public:
  void Clear() { log_sharpness_.clear(); }
  void Add(double log_sharpness) { log_sharpness_.push_back(log_sharpness); }

  // Both are false while there are too few images to tell.
  bool IsBlurred(double log_sharpness) const;  // most of the others are clearly sharper
  bool IsSharp(double log_sharpness) const;  // most are clearly less sharp, and hardly one is more

  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive) {
    archive.List(log_sharpness_, [&](double& each) { archive.Number(each); });
  }

 private:
  double Quantile(double share) const;

  std::vector<double> log_sharpness_;
};

}  // namespace mono3d::tracking
