// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/single_views.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "depth/plane_scene.h"

namespace mono3d {
namespace {

// 160x96 pixels; the cameras on either side of the reference see the plane about 15 px further on.
class SingleViews : public testing::Test {
 protected:
  SingleViews() : depth_(scene_.TrueDepth()) {}

  cv::Mat Found() const {
    return FindSingleViews(SweepGeometry(scene_.Bundle()), depth_) == kDoubtfulSingle;
  }
  int NumFound(const cv::Rect& pixels) const { return cv::countNonZero(Found()(pixels)); }
  // As seen `motion_px` further on by the cameras next to the reference.
  void Set(const cv::Rect& pixels, double motion_px) {
    depth_(pixels).setTo(scene_.camera.fx * scene_.baseline / motion_px);
  }

  PlaneScene scene_{.num_images = 3};
  cv::Mat depth_;
};

TEST_F(SingleViews, OfASurfaceAreKept) {
  // The plane is tilted: of the last pixels in view, some would not be at a depth 1.5 cells away.
  EXPECT_LT(cv::countNonZero(Found()), 10);
}

TEST_F(SingleViews, ThatWouldLeaveTheImageAtADepthAroundAreDoubtful) {
  // At the left border one camera alone sees the plane. With 150 px it would see a part of the
  // columns that it sees at 15 px.
  const cv::Rect near_by(0, 32, 32, 32);
  const cv::Mat before = depth_.clone();
  Set(cv::Rect(32, 32, 32, 32), 150);
  EXPECT_GT(NumFound(near_by), 0);
  before.copyTo(depth_);
  Set(cv::Rect(32, 32, 32, 1), 150);
  EXPECT_EQ(NumFound(near_by), 0) << "a few pixels may be wrong";
  before.copyTo(depth_);
  Set(cv::Rect(96, 32, 32, 32), 150);
  EXPECT_EQ(NumFound(near_by), 0) << "that is not around";
}

TEST_F(SingleViews, AreTheOnlyOnesThatAreDoubtful) {
  // In view of both cameras at its own depth.
  const cv::Rect middle(64, 32, 32, 32);
  Set(cv::Rect(96, 32, 32, 32), 150);
  EXPECT_EQ(NumFound(middle), 0);
}

TEST_F(SingleViews, AreNoneWithoutDepth) {
  depth_.setTo(0);
  EXPECT_EQ(cv::countNonZero(Found()), 0);
}

}  // namespace
}  // namespace mono3d
