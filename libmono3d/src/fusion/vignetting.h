// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <deque>
#include <opencv2/core/mat.hpp>

#include "mono3d/geometry/similarity.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// How much darker an image becomes towards its corners: grey value = exp(a r^2 + b r^4) * that
// without, where r is the distance from the principal point in halves of the image's diagonal.
// Learned from places that depth maps show at one radius and depth maps shortly before them showed
// at another: the logarithms of their grey values differ by that of the gains, the same for all
// places of a pair of images, and by the falloff between the radii, the same for all pairs.
class Vignetting {
 public:
  // A depth map of the model, placed at `S_world_kf`.
  void Add(const DepthMap& map, const Similarity& S_world_kf);
  // The next depth map has nothing to do with those before it.
  void ForgetViews() { views_.clear(); }

  // Whether there is a falloff beyond doubt.
  bool IsKnown() const;
  // Share of the grey value that a pixel keeps; 1 in the middle.
  double FalloffAt(const CameraModel& camera, double x, double y) const;
  // The image without it, a copy; clipped values stay. The image itself where none is known.
  cv::Mat Corrected(const cv::Mat& bgr, const CameraModel& camera) const;

  // For a saved state, the views apart; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);
  std::size_t num_views() const { return views_.size(); }
  template <typename Archive>
  void ExchangeView(Archive& archive, std::size_t number);

 private:
  struct View {
    CameraModel camera;
    Similarity S_world_kf;
    cv::Mat grey;   // CV_8UC1
    cv::Mat depth;  // CV_32FC1, in the unit of the keyframe
  };

  struct Sample {
    Eigen::Vector3d p_cam;  // in the unit of the keyframe
    double log_grey;        // mean around it
    double radius_square;   // in halves of the diagonal
  };

  static std::vector<Sample> SamplesOf(const View& view);
  void Compare(const View& now, const std::vector<Sample>& samples, const View& before);
  Eigen::Vector2d Coefficients() const;

  std::deque<View> views_;  // oldest first
  // Normal equations of a and b over all pairs.
  Eigen::Matrix2d information_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right_ = Eigen::Vector2d::Zero();
};

}  // namespace mono3d
