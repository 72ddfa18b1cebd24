// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/mesh_texturing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "products/triangle_raster.h"

namespace mono3d {
namespace {

// A cube of side 2 around the origin whose colours are known everywhere.
Eigen::Vector3f CubeColour(const Eigen::Vector3f& p) {
  return {128 + 60 * std::sin(3 * p.x() + p.z()), 128 + 60 * std::sin(2 * p.y() - 2 * p.x()),
          128 + 60 * std::sin(3 * p.z() + p.y())};  // blue, green, red
}

constexpr int kCells = 6;  // along an edge

TriangleMesh CubeMesh() {
  TriangleMesh mesh;
  const auto add_vertex = [&](const Eigen::Vector3f& p, const Eigen::Vector3f& normal) {
    mesh.vertices.push_back(p);
    mesh.normals.push_back(normal);
    const Eigen::Vector3f colour = CubeColour(p);
    mesh.colours.push_back({static_cast<std::uint8_t>(std::lround(colour[2])),
                            static_cast<std::uint8_t>(std::lround(colour[1])),
                            static_cast<std::uint8_t>(std::lround(colour[0]))});
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.F, 1.F}) {
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      Eigen::Vector3f normal = Eigen::Vector3f::Zero();
      normal[axis] = side;
      Eigen::Vector3f u = Eigen::Vector3f::Zero();
      u[(axis + 1) % 3] = 1;
      const Eigen::Vector3f v = normal.cross(u);
      for (int row = 0; row <= kCells; ++row) {
        for (int column = 0; column <= kCells; ++column) {
          add_vertex(normal + (2.F * static_cast<float>(column) / kCells - 1) * u +
                         (2.F * static_cast<float>(row) / kCells - 1) * v,
                     normal);
        }
      }
      for (std::uint32_t row = 0; row < kCells; ++row) {
        for (std::uint32_t column = 0; column < kCells; ++column) {
          const std::uint32_t a = first + row * (kCells + 1) + column;
          const std::uint32_t c = a + kCells + 2;
          mesh.triangles.push_back({a, a + 1, c});
          mesh.triangles.push_back({a, c, c - 1});
        }
      }
    }
  }
  return mesh;
}

// Where a ray from outside enters the cube.
std::optional<Eigen::Vector3f> CubeHit(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  double near = 0;
  double far = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-1 - from[axis]) / ray[axis];
    const double b = (1 - from[axis]) / ray[axis];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  if (near > far) return std::nullopt;
  return Eigen::Vector3d(from + near * ray).cast<float>();
}

CameraModel CubeCamera() {
  return {.width = 160, .height = 140, .fx = 200, .fy = 200, .cx = 79.5, .cy = 69.5};
}

Pose LookAtOrigin(const Eigen::Vector3d& from) {
  const Eigen::Vector3d forward = -from.normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return {rotation, from};
}

cv::Mat CubePhoto(const CameraModel& camera, const Pose& T_world_cam, float gain) {
  cv::Mat photo(camera.height, camera.width, CV_8UC3, cv::Scalar(10, 200, 10));
  for (int y = 0; y < photo.rows; ++y) {
    for (int x = 0; x < photo.cols; ++x) {
      const Eigen::Vector2d pixel(x, y);
      Eigen::Vector3d ray = camera.Unproject(pixel);
      for (int step = 0; step < 20; ++step) {
        const Eigen::Vector2d error = pixel - ProjectDistorted(camera, ray);
        ray.head<2>() += Eigen::Vector2d(error.x() / camera.fx, error.y() / camera.fy);
      }
      const auto hit = CubeHit(T_world_cam.translation(), T_world_cam.rotation() * ray);
      if (!hit) continue;
      const Eigen::Vector3f colour = gain * CubeColour(*hit);
      for (int c = 0; c < 3; ++c) {
        photo.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<uchar>(colour[c]);
      }
    }
  }
  return photo;
}

// From all around and above; nobody sees the side below.
std::vector<TextureView> CubeViews(const CameraModel& camera,
                                   const std::function<void(int, cv::Mat&)>& change = {},
                                   float gain_step = 0) {
  std::vector<TextureView> views;
  for (int i = 0; i < 12; ++i) {
    const double angle = .4 + .5236 * i;
    const Pose pose = LookAtOrigin({4 * std::cos(angle), 4 * std::sin(angle), 2.5 + .1 * (i % 3)});
    cv::Mat photo = CubePhoto(camera, pose, 1 + gain_step * static_cast<float>(i % 4 - 2));
    if (change) change(i, photo);
    views.push_back({.read = [photo] { return photo; }, .camera = camera, .T_world_cam = pose});
  }
  return views;
}

constexpr double kSurfaceError = .01;

// Within two pixels of an edge of the cube, where images mix it with what is behind.
bool IsAtAnEdge(const Eigen::Vector3f& p) { return (p.array().abs() > .93F).count() > 1; }

struct TexelErrors {
  double largest = 0;
  double mean = 0;
  int count = 0;
  Eigen::Vector3f where = Eigen::Vector3f::Zero();  // of the largest
};

// Every texel of a triangle against the colour of the surface there.
TexelErrors CompareTexels(const TexturedMesh& mesh) {
  TexelErrors errors;
  for (std::size_t part = 0; part < mesh.triangles.size(); ++part) {
    const cv::Mat& texture = mesh.textures[part];
    for (const auto& corners : mesh.triangles[part]) {
      std::array<Eigen::Vector2f, 3> texels;
      Eigen::Matrix3f points;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector2f& at = mesh.texture_coordinates[corners.at(k)];
        texels.at(k) = {at.x() * static_cast<float>(texture.cols) - .5F,
                        at.y() * static_cast<float>(texture.rows) - .5F};
        points.col(static_cast<int>(k)) = mesh.vertices[corners.at(k)];
      }
      RasteriseTriangle(texels, texture.size(), [&](int x, int y, const Eigen::Vector3f& shares) {
        const Eigen::Vector3f truth = CubeColour(points * shares);
        const auto& texel = texture.at<cv::Vec3b>(y, x);
        for (int c = 0; c < 3; ++c) {
          const double error = std::abs(static_cast<double>(texel[c]) - truth[c]);
          errors.mean += error;
          ++errors.count;
          if (error <= errors.largest || IsAtAnEdge(points * shares)) continue;
          errors.largest = error;
          errors.where = points * shares;
        }
      });
    }
  }
  errors.mean /= std::max(errors.count, 1);
  return errors;
}

// A pixel is .03 wide on the cube, over which colours change by up to 7 levels; bilinear values and
// rounding leave a part of that. Where no view shows the surface, vertices tell it: between those
// of a diagonal, .47 apart, the line is 13 levels off the sine.
constexpr double kLargestError = 14;
constexpr double kMeanError = 1;

TEST(TextureMesh, HasTheColoursOfTheSurfaceAtEveryTexel) {
  const TexturingResult result = TextureMesh(CubeMesh(), CubeViews(CubeCamera()), kSurfaceError);
  EXPECT_EQ(result.num_unseen, 2u * kCells * kCells);
  EXPECT_EQ(result.texels_per_pixel, 1);
  ASSERT_EQ(result.mesh.textures.size(), 1u);
  ASSERT_EQ(result.mesh.triangles[0].size(), 12u * kCells * kCells);
  // Five sides and some of each side's corners; the triangles below are a chart each.
  EXPECT_LE(result.num_charts, 2u * kCells * kCells + 20);
  const TexelErrors errors = CompareTexels(result.mesh);
  EXPECT_GT(errors.count, 50000);
  EXPECT_LE(errors.largest, kLargestError) << errors.where.transpose();
  EXPECT_LE(errors.mean, kMeanError);
}

TEST(TextureMesh, TakesDistortionOut) {
  CameraModel camera = CubeCamera();
  camera.distortion = {-.1, .02, .001, -.001, 0};
  const TexelErrors errors =
      CompareTexels(TextureMesh(CubeMesh(), CubeViews(camera), kSurfaceError).mesh);
  EXPECT_LE(errors.largest, kLargestError) << errors.where.transpose();
  EXPECT_LE(errors.mean, kMeanError + .5);  // values are interpolated twice
}

TEST(TextureMesh, EvensOutExposures) {
  const auto views = CubeViews(CubeCamera(), {}, .1F);  // from .8 to 1.1
  const TexelErrors errors = CompareTexels(TextureMesh(CubeMesh(), views, kSurfaceError).mesh);
  EXPECT_LE(errors.largest, kLargestError + 4) << errors.where.transpose();
  EXPECT_LE(errors.mean, kMeanError + 1);
}

TEST(TextureMesh, LeavesOutWhatOneViewAloneShows) {
  // Something red in the middle of every sixth image; two of about six that show a place.
  const auto views = CubeViews(CubeCamera(), [](int i, cv::Mat& photo) {
    if (i % 6 == 0) photo(cv::Rect(60, 50, 40, 40)).setTo(cv::Scalar(0, 0, 255));
  });
  const TexelErrors errors = CompareTexels(TextureMesh(CubeMesh(), views, kSurfaceError).mesh);
  EXPECT_LE(errors.mean, kMeanError);
}

TEST(TextureMesh, BlendsViewsWhereAsked) {
  // Bright and dark by turns: the mean of many is what both are not.
  const auto noise = [](int i, cv::Mat& photo) {
    cv::add(photo, cv::Scalar::all(i % 2 == 0 ? 20 : -20), photo);
  };
  TexturingOptions options;
  options.num_blended = 6;
  const TexelErrors errors = CompareTexels(
      TextureMesh(CubeMesh(), CubeViews(CubeCamera(), noise), kSurfaceError, options).mesh);
  EXPECT_LE(errors.mean, 6);
}

TEST(TextureMesh, FitsIntoSmallTextures) {
  TexturingOptions options;
  options.texture_side_px = 128;
  options.max_textures = 3;
  const TexturingResult result =
      TextureMesh(CubeMesh(), CubeViews(CubeCamera()), kSurfaceError, options);
  EXPECT_LT(result.texels_per_pixel, 1);
  EXPECT_GT(result.mesh.textures.size(), 1u);
  EXPECT_LE(result.mesh.textures.size(), 3u);
  for (const cv::Mat& texture : result.mesh.textures) {
    EXPECT_LE(std::max(texture.cols, texture.rows), 128);
  }
  EXPECT_LE(CompareTexels(result.mesh).mean, kMeanError + .5);  // more of it unseen
}

TEST(TextureMesh, GoesOnWithoutImagesThatCannotBeRead) {
  auto views = CubeViews(CubeCamera());
  views[3].read = []() -> cv::Mat { throw Error("gone"); };
  views[4].read = [] { return cv::Mat(10, 10, CV_8UC3, cv::Scalar::all(0)); };
  const TexelErrors errors = CompareTexels(TextureMesh(CubeMesh(), views, kSurfaceError).mesh);
  EXPECT_LE(errors.mean, kMeanError);
  for (auto& view : views) view.read = []() -> cv::Mat { throw Error("gone"); };
  EXPECT_THROW(TextureMesh(CubeMesh(), views, kSurfaceError), Error);
}

TEST(TextureMesh, RefusesADamagedMesh) {
  const auto views = CubeViews(CubeCamera());
  TriangleMesh mesh = CubeMesh();
  mesh.colours.clear();
  EXPECT_THROW(TextureMesh(mesh, views, kSurfaceError), Error);
  mesh = CubeMesh();
  mesh.triangles[0][1] = 100000;
  EXPECT_THROW(TextureMesh(mesh, views, kSurfaceError), Error);
  EXPECT_THROW(TextureMesh({}, views, kSurfaceError), Error);
  TexturingOptions options;
  options.num_blended = 0;
  EXPECT_THROW(TextureMesh(CubeMesh(), views, kSurfaceError, options), UsageError);
}

}  // namespace
}  // namespace mono3d
