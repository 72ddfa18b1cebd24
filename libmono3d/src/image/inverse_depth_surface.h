// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

namespace mono3d {

struct InverseDepthSample {
  Eigen::Vector2d pixel;
  double inverse_depth = 0;
};

// A smooth inverse z-depth for every pixel of an image, from those of some points: a smoothing
// spline on a coarse grid, fitted with robust weights. That of a plane is met exactly, for it is
// affine in the pixel.
class InverseDepthSurface {
 public:
  // The same everywhere.
  explicit InverseDepthSurface(double inverse_depth) : nodes_(1, inverse_depth) {}
  // `samples`: one at least, of finite numbers.
  InverseDepthSurface(int width, int height, const std::vector<InverseDepthSample>& samples);

  // 0 or more.
  double At(const Eigen::Vector2d& pixel) const;

 private:
  // A value of the surface as a sum of four nodes.
  struct Interpolation {
    int node[4];
    double weight[4];
  };
  class Fit;

  Interpolation InterpolationAt(const Eigen::Vector2d& pixel) const;
  double Unlimited(const Interpolation& at) const;

  double cell_px_ = 0;
  int num_columns_ = 1;  // of nodes, the first at pixel 0
  int num_rows_ = 1;
  std::vector<double> nodes_;  // row by row
  double largest_ = 0;         // what lies beyond all points is not taken for nearer than this
};

}  // namespace mono3d
