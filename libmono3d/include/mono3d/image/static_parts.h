// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Finds what stays at its place in the images of a camera that moves, and so is no part of the
// scene: text and marks drawn into a video, a car's bonnet, a landing gear; or, of a camera that
// stands still, what is behind an object on a turntable. Tracked, it says that the camera stands
// still.
//
// A corner that stays is in the mean of the images as strong as in each of them; one that moves is
// averaged away. Edges are not enough: a kerb stays at its place on a straight drive. Bars along
// the borders have no corners; they never change at all. Bare parts count where they touch corners
// that stay. Images that hardly differ from the one before tell nothing and are passed over.
class StaticPartsDetector {
 public:
  // CV_8UC3, all of one size; throws Error for others. Best are some 40 from all over a recording.
  void Add(const cv::Mat& bgr);

  // CV_8UC1 of the images' size, 255 where something stays. Empty where nothing does, where fewer
  // than 12 images differ from one another (of fewer than 25 what stays must be a large part of
  // them, as behind a turntable), and where nearly all of what is seen stays: then the camera stood
  // still, and there is no scene.
  cv::Mat Find() const;

 private:
  cv::Size size_;
  int num_images_ = 0;  // that count
  // At the working size; grey levels per pixel. Of the last image that counts, and sums over all.
  cv::Mat last_x_, last_y_;
  cv::Mat sum_x_, sum_y_;
  cv::Mat sum_strength_;  // of corners: the smaller eigenvalue of the structure tensor
  cv::Mat least_, most_;  // grey levels over all of them
};

}  // namespace mono3d
