// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace mono3d {

// An image as its motion is measured: grey, its longer side of 192 px, and two octaves above.
struct SmallImage {
  // `bgr`: CV_8UC3.
  explicit SmallImage(const cv::Mat& bgr);

  static constexpr std::size_t kNumLevels = 3;
  std::array<cv::Mat, kNumLevels> levels;  // CV_32FC1, the finest first
};

// Measures by how much other images of one size have moved against one: small blocks all over it
// are found again, whatever the brightness (Lucas and Kanade 1981, with the steps of the image that
// stays). A quarter of a pixel of the small image is the least that a block must be certain to.
class ImageMotion {
 public:
  explicit ImageMotion(SmallImage from);

  // What a quarter of the blocks exceed, as a share of the longer side: parts that move by
  // themselves are no motion of the camera as long as they are less. Nothing where the images have
  // too little in common, or too little that can be found again, to tell.
  std::optional<double> To(const SmallImage& image) const;

 private:
  static constexpr int kRadius_px = 4;
  static constexpr int kSide_px = 2 * kRadius_px + 1;
  static constexpr std::size_t kArea = kSide_px * kSide_px;

  // One level of a block: its grey values and steps, both free of their means.
  struct Template {
    cv::Point2f centre;
    std::array<float, kArea> grey{};
    std::array<cv::Point2f, kArea> steps{};
    // The inverse of the sum of the products of steps: xx, xy, yy.
    float inverse_xx = 0;
    float inverse_xy = 0;
    float inverse_yy = 0;
    float variance = 0;  // of the grey values
  };
  using Block = std::array<std::optional<Template>, SmallImage::kNumLevels>;

  void AddBlock(cv::Point centre);
  static std::optional<Template> MakeTemplate(const cv::Mat& image, cv::Point at);
  static std::optional<cv::Point2f> Align(const Template& block, const cv::Mat& grey,
                                          cv::Point2f motion);
  static std::optional<cv::Point2f> Find(const Block& block, const SmallImage& image);

  SmallImage from_;
  std::vector<Block> blocks_;
};

}  // namespace mono3d
