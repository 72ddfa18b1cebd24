// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace mono3d::tools {

struct DepthPictureOptions {
  int panel_width_px = 480;  // of each of the panels side by side
  double max_depth = 0;      // of the truth, as in CompareDepth
  // Relative error at the end of the colour scale; 0: chosen from the map, one of 0.5, 1, 2, 5, 10,
  // 20, 50 %.
  double max_relative_error = 0;
  std::string unit = "m";
};

// Maps as in CompareDepth; CV_8UC3 (BGR) out. Where there is none, light grey. Throws Error when
// type or size differ or the panels are narrower than 160 px.

// Estimate (times `scale`) | truth | relative error. Estimate and truth share one colour scale over
// inverse depth, with a legend in the truth's unit; the error has its own, in percent.
cv::Mat DepthPicture(const cv::Mat& estimate, const cv::Mat& truth, double scale,
                     const DepthPictureOptions& options = {});

// Confidence | relative error. Where the confidence is right, bright on the left is dark on the
// right.
cv::Mat ConfidencePicture(const cv::Mat& confidence, const cv::Mat& estimate, const cv::Mat& truth,
                          double scale, const DepthPictureOptions& options = {});

}  // namespace mono3d::tools
