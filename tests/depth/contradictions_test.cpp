// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/contradictions.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "depth/plane_scene.h"

namespace mono3d {
namespace {

// A plane that is about 15 px of motion away from the cameras on either side.
class Contradictions : public testing::Test {
 protected:
  Contradictions()
      : depth_(scene_.TrueDepth()), confidence_(depth_.size(), CV_32FC1, cv::Scalar(0.5)) {}

  double Plane() const { return 1 / (scene_.camera.fx * scene_.baseline); }
  cv::Mat Found() const {
    return FindContradicted(SweepGeometry(scene_.Bundle()), depth_, confidence_, 2 * Plane());
  }
  // The share of these pixels that is contradicted.
  static double Share(const cv::Mat& found, const cv::Rect& pixels) {
    return double(cv::countNonZero(found(pixels))) / pixels.area();
  }
  // Moves the points so that the cameras next to the reference see them `by_px` further on.
  void Shift(const cv::Rect& pixels, float by_px, float confidence) {
    for (int y = pixels.y; y < pixels.br().y; ++y) {
      for (int x = pixels.x; x < pixels.br().x; ++x) {
        float& depth_su = depth_.at<float>(y, x);
        depth_su = 1 / (1 / depth_su + by_px * static_cast<float>(Plane()));
      }
    }
    confidence_(pixels).setTo(confidence);
  }

  PlaneScene scene_{.num_images = 3};
  cv::Mat depth_;
  cv::Mat confidence_;
};

const cv::Rect kPatch(70, 40, 16, 16);  // in view of both sources

TEST_F(Contradictions, AreNoneOnASurface) {
  EXPECT_EQ(cv::countNonZero(Found()), 0);
  depth_(kPatch).setTo(0);
  EXPECT_EQ(cv::countNonZero(Found()), 0);
}

TEST_F(Contradictions, TakeWhatIsLessSureOnlyWhereAllSourcesShowAnotherPoint) {
  // By more than its size: the places that it leaves in the sources belong to nobody.
  Shift(kPatch, 18, 0.1f);
  EXPECT_EQ(Share(Found(), kPatch), 1);
  confidence_(kPatch).setTo(0.9);
  const cv::Mat found = Found();
  EXPECT_EQ(Share(found, kPatch), 0) << "it is surer than what it contradicts";
  EXPECT_EQ(cv::countNonZero(found), 0) << "which the source on the other side bears out";
}

TEST_F(Contradictions, AreNoneWithinTheTolerance) {
  Shift(kPatch, 1.5f, 0.1f);
  EXPECT_EQ(cv::countNonZero(Found()), 0);
}

TEST_F(Contradictions, OfOneSourceAreEnoughWhereNoOtherSeesThePoint) {
  // At the border; the camera on one side does not see it.
  for (const int x : {0, depth_.cols - 8}) {
    depth_ = scene_.TrueDepth();
    confidence_.setTo(0.5);
    const cv::Rect border(x, 40, 8, 16);
    Shift(border, 12, 0.1f);
    EXPECT_EQ(Share(Found(), border), 1) << x;
    Shift(border, -12, 0.1f);
    EXPECT_EQ(Share(Found(), border), 0) << x;
  }
}

TEST_F(Contradictions, OfASourceThatShowsNoDepthDoNotCount) {
  ImageBundle bundle = scene_.Bundle();
  bundle.T_ref_cam.front() = Pose();
  Shift(kPatch, 18, 0.1f);
  const cv::Mat found = FindContradicted(SweepGeometry(bundle), depth_, confidence_, 2 * Plane());
  EXPECT_EQ(Share(found, kPatch), 1);
}

}  // namespace
}  // namespace mono3d
