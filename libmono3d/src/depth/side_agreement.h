// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "depth/grey_images.h"
#include "depth/sweep_geometry.h"

namespace mono3d {

// Mean Hamming distances between the census windows of one scene point in different images, as
// shares of the bits, 0 to 1, by the sides of the bundle: the images before the reference in its
// list are one, those after it the other.
struct SideDifferences {
  double before = 0;  // between the reference and the images before it
  double after = 0;   // between the reference and the images after it
  double across = 0;  // between the images before the reference and those after it
  double worse = 0;   // the mean over the pixels of the larger of `before` and `after`
};

// The means over some hundred pixels that have a depth (CV_32FC1; 0: no estimate) and are in view
// of images on both sides, at the places to which the depth projects them. Windows follow the
// surface by its normal (CV_32FC3, camera frame): a slanted one is stretched in the images of one
// side and compressed in those of the other, which looks as if the sides were independent. Empty
// when there are fewer than 25 such pixels.
std::optional<SideDifferences> MeasureSides(const GreyImages& images, const SweepGeometry& geometry,
                                            const cv::Mat& depth, const cv::Mat& normal);

// True when the images do not show the same scene, so that the depths are chance matches. The sweep
// picks the depth at which both sides resemble the reference. If that resemblance is chance, the
// two sides are independent of each other: with b = before and a = after, across = b + a - 2 a b.
// If all images show the same point and differ by independent noise, across is the mean of b and a.
// The test is where `across` lies between these two.
bool AreUnrelated(const SideDifferences& sides);

}  // namespace mono3d
