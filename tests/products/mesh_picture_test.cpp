// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/mesh_picture.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

// A triangle that faces a camera at the origin which looks along z.
void AddFacingTriangle(TriangleMesh& mesh, const Eigen::Vector3f& corner, float side) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(corner);
  mesh.vertices.push_back(corner + Eigen::Vector3f(0, side, 0));
  mesh.vertices.push_back(corner + Eigen::Vector3f(side, 0, 0));
  mesh.triangles.push_back({first, first + 1, first + 2});
}

const CameraModel kPictureCamera = {
    .width = 100, .height = 100, .fx = 100, .fy = 100, .cx = 50, .cy = 50};

TEST(MeshPicture, SeesWhatIsInFrontAndWhole) {
  TriangleMesh mesh;
  AddFacingTriangle(mesh, {-1, -1, 10}, 2);   // hides the next one
  AddFacingTriangle(mesh, {-1, -1, 20}, 1);   // within its shadow
  AddFacingTriangle(mesh, {2, 2, 10}, 1);     // beside both
  AddFacingTriangle(mesh, {4.5F, 0, 10}, 2);  // leaves the image
  AddFacingTriangle(mesh, {-4, 0, -10}, 1);   // behind the camera
  AddFacingTriangle(mesh, {-4, 2, 10}, 1);
  std::swap(mesh.triangles[5][1], mesh.triangles[5][2]);  // seen from behind
  const MeshPicture picture(mesh, kPictureCamera, Pose(), .01);
  const auto first = picture.See(0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->is_clear);           // its outline is against nothing
  EXPECT_NEAR(first->area_px, 200, 1e-3);  // half of 20 x 20
  EXPECT_FALSE(picture.See(1));
  EXPECT_TRUE(picture.See(2));
  for (const std::size_t unseen : {3, 4, 5}) EXPECT_FALSE(picture.See(unseen)) << unseen;
  EXPECT_NEAR((picture.Pixel(0) - Eigen::Vector2f(40, 40)).norm(), 0, 1e-4);
}

TEST(MeshPicture, TellsWhereTheSurfaceDoesNotGoOn) {
  TriangleMesh mesh;
  AddFacingTriangle(mesh, {-2, -2, 10}, 2);           // its legs end at pixel 30
  AddFacingTriangle(mesh, {-4.4F, -3.8F, 20}, .16F);  // two pixels of the other's edge away
  AddFacingTriangle(mesh, {-4.4F, -8, 20}, .5F);      // far from it
  AddFacingTriangle(mesh, {-20, -20, 20}, 60);        // around all of them
  const MeshPicture picture(mesh, kPictureCamera, Pose(), .01);
  ASSERT_TRUE(picture.See(0));
  EXPECT_FALSE(picture.See(0)->is_clear);
  ASSERT_TRUE(picture.See(1));
  EXPECT_FALSE(picture.See(1)->is_clear);
  ASSERT_TRUE(picture.See(2));
  EXPECT_TRUE(picture.See(2)->is_clear);
}

TEST(ColourAt, IsBilinear) {
  cv::Mat image(2, 2, CV_8UC3, cv::Scalar::all(0));
  image.at<cv::Vec3b>(0, 1) = {100, 0, 0};
  image.at<cv::Vec3b>(1, 1) = {100, 200, 0};
  const Eigen::Vector3f colour = ColourAt(image, {.5F, .25F});
  EXPECT_NEAR(colour[0], 50, 1e-4);
  EXPECT_NEAR(colour[1], 25, 1e-4);
  EXPECT_EQ(ColourAt(image, {1, 1})[1], 200);  // at the border nothing beyond is read
}

}  // namespace
}  // namespace mono3d
