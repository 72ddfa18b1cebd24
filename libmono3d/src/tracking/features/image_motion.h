// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono3d/geometry/camera_model.h"

namespace mono3d::tracking {

// How an image moves while the lines of a rolling shutter are read, by the images taken before and
// after it: a homography to each, which what is near and what is far away share but for the way of
// the camera during a frame. For what has no pose yet; see ShutterMotion.
class ImageMotion {
 public:
  // Of pixels of an image into another one, both free of distortion, taken so much later.
  struct Neighbour {
    Eigen::Matrix3d H_other_here;
    double later_s = 0;  // negative: before
  };

  // Nothing is known: no pixel moves.
  ImageMotion() = default;
  // One or two neighbours, of different times; `camera`: of the image, beside the `sensor` that
  // took it.
  ImageMotion(const CameraModel& camera, const CameraModel& sensor,
              std::vector<Neighbour> neighbours);

  const std::vector<Neighbour>& neighbours() const { return neighbours_; }
  // Where the image would show what it shows at a pixel, were all lines read with the middle one:
  // by the path of second order in time through the pixel and where its neighbours show the same.
  Eigen::Vector2d AtMiddleLine(const Eigen::Vector2d& pixel) const;
  // When the line is read that shows a pixel, in s after the middle line.
  double LineTime_s(const Eigen::Vector2d& pixel) const;

 private:
  CameraModel camera_;
  CameraModel sensor_;
  std::vector<Neighbour> neighbours_;
};

}  // namespace mono3d::tracking
