// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/mesh_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "products/triangle_raster.h"

namespace mono3d {
namespace {

// Pixels around a triangle where the surface must go on: edges in the mesh are off by about a
// pixel, and images are blurred by as much.
constexpr int kClearance_px = 2;

// Where a triangle is tested: near its corners, and in its middle.
constexpr std::array<std::array<float, 3>, 4> kTestedShares = {
    {{.8F, .1F, .1F}, {.1F, .8F, .1F}, {.1F, .1F, .8F}, {1 / 3.F, 1 / 3.F, 1 / 3.F}}};

}  // namespace

MeshPicture::MeshPicture(const TriangleMesh& mesh, const CameraModel& camera,
                         const Pose& T_world_cam, double surface_error_su)
    : mesh_(mesh),
      camera_(camera),
      T_cam_world_(T_world_cam.Inverse()),
      surface_error_su_(surface_error_su),
      pixels_(mesh.vertices.size()),
      inverse_depths_(mesh.vertices.size(), 0) {
  const cv::Size size(camera.width, camera.height);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p_cam = T_cam_world_ * mesh.vertices[i].cast<double>();
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = camera.Project(p_cam);
    // Triangles that reach farther out than this hide nothing: they are larger than any image.
    if (!(pixel.cwiseAbs().maxCoeff() < 4.0 * std::max(size.width, size.height))) continue;
    pixels_[i] = pixel.cast<float>();
    inverse_depths_[i] = static_cast<float>(1 / p_cam.z());
  }
  nearest_ = cv::Mat::zeros(size, CV_32FC1);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f depths(inverse_depths_[a], inverse_depths_[b], inverse_depths_[c]);
    if (depths.minCoeff() <= 0) continue;
    // Inverse depth is linear in the image.
    RasteriseTriangle({pixels_[a], pixels_[b], pixels_[c]}, size,
                      [&](int x, int y, const Eigen::Vector3f& shares) {
                        float& nearest = nearest_.at<float>(y, x);
                        nearest = std::max(nearest, shares.dot(depths));
                      });
  }
  const cv::Mat window = cv::Mat::ones(2 * kClearance_px + 1, 2 * kClearance_px + 1, CV_8UC1);
  cv::dilate(nearest_, nearest_around_, window);
  cv::erode(nearest_, farthest_around_, window);
}

std::optional<SeenTriangle> MeshPicture::See(std::size_t triangle) const {
  const auto& corners = mesh_.triangles[triangle];
  std::array<Eigen::Vector2f, 3> pixels;
  Eigen::Vector3f depths;
  for (std::size_t k = 0; k < 3; ++k) {
    pixels.at(k) = pixels_[corners.at(k)];
    depths[static_cast<int>(k)] = inverse_depths_[corners.at(k)];
    if (depths[static_cast<int>(k)] <= 0) return std::nullopt;
    if (!camera_.Contains(pixels.at(k).cast<double>())) return std::nullopt;
  }
  const Eigen::Vector2f ab = pixels[1] - pixels[0];
  const Eigen::Vector2f ac = pixels[2] - pixels[0];
  // Counter-clockwise as seen from outside is clockwise where y goes down.
  const float area_px = -(ab.x() * ac.y() - ab.y() * ac.x()) / 2;
  if (!(area_px > 0)) return std::nullopt;

  // On the plane of the triangle, normal * p = offset, inverse depth grows by normal / (offset f)
  // per pixel.
  std::array<Eigen::Vector3d, 3> p_cam;
  for (std::size_t k = 0; k < 3; ++k) {
    p_cam.at(k) = T_cam_world_ * mesh_.vertices[corners.at(k)].cast<double>();
  }
  const Eigen::Vector3d normal = (p_cam[1] - p_cam[0]).cross(p_cam[2] - p_cam[0]);
  const double offset = normal.dot(p_cam[0]);
  if (offset == 0) return std::nullopt;
  const auto slope = static_cast<float>(std::abs(normal.x() / (offset * camera_.fx)) +
                                        std::abs(normal.y() / (offset * camera_.fy)));
  SeenTriangle seen{.area_px = area_px, .is_clear = true};
  for (const auto& tested : kTestedShares) {
    const Eigen::Vector3f shares(tested[0], tested[1], tested[2]);
    const Eigen::Vector2f pixel =
        shares[0] * pixels[0] + shares[1] * pixels[1] + shares[2] * pixels[2];
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    const float depth = shares.dot(depths);
    const float error = static_cast<float>(surface_error_su_) * depth * depth;
    // The pixel's centre is up to half a pixel off either way.
    if (nearest_.at<float>(y, x) > depth + .5F * slope + error) return std::nullopt;
    const float margin = (kClearance_px + .5F) * slope + 2 * error;
    if (nearest_around_.at<float>(y, x) > depth + margin ||
        farthest_around_.at<float>(y, x) < depth - margin) {
      seen.is_clear = false;
    }
  }
  return seen;
}

Eigen::Vector3f ColourAt(const cv::Mat& bgr, const Eigen::Vector2f& pixel) {
  const int x = std::clamp(static_cast<int>(std::floor(pixel.x())), 0, bgr.cols - 1);
  const int y = std::clamp(static_cast<int>(std::floor(pixel.y())), 0, bgr.rows - 1);
  const int right = std::min(x + 1, bgr.cols - 1);
  const int below = std::min(y + 1, bgr.rows - 1);
  const float u = std::clamp(pixel.x() - static_cast<float>(x), 0.F, 1.F);
  const float v = std::clamp(pixel.y() - static_cast<float>(y), 0.F, 1.F);
  const auto at = [&](int column, int row) {
    const cv::Vec3b& colour = bgr.at<cv::Vec3b>(row, column);
    return Eigen::Vector3f(colour[0], colour[1], colour[2]);
  };
  return (1 - v) * ((1 - u) * at(x, y) + u * at(right, y)) +
         v * ((1 - u) * at(x, below) + u * at(right, below));
}

}  // namespace mono3d
