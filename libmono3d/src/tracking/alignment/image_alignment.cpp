// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/image_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

constexpr int kSquareSide = 4;  // px, as Forster et al. have it
constexpr int kSquarePixels = kSquareSide * kSquareSide;
constexpr float kFirst = -1.5F;   // of the patch's rows and columns about the point
constexpr int kFinestOctave = 1;  // the patches find what is left, on the finest one
// Six for the motion, then contrast and brightness.
using Vector8f = Eigen::Matrix<float, 8, 1>;
using Matrix8f = Eigen::Matrix<float, 8, 8>;
using Matrix48f = Eigen::Matrix<float, 4, 8>;

// The surroundings of a point in image a, and how they change with the unknowns: all pixels of it
// move alike, so the Jacobian of each is a row of four times a matrix of the point.
struct Surroundings {
  Eigen::Vector3d p_a;
  std::array<Eigen::Vector4f, kSquarePixels> row;  // gradient x, y; grey value; 1
  Matrix48f by_unknowns = Matrix48f::Zero();
};

bool Contains(const cv::Mat& image, const Eigen::Vector2f& at) {
  constexpr float kMargin = 3;  // half a patch and the gradient
  return at.x() >= kMargin && at.y() >= kMargin &&
         at.x() < static_cast<float>(image.cols) - kMargin - 1 &&
         at.y() < static_cast<float>(image.rows) - kMargin - 1;
}

using Square = std::array<Eigen::Vector4f, kSquareSide>;

// Brightness of the pixels around `at`, row by row: they lie alike between those of the image,
// which must contain them.
Square Sample(const cv::Mat& image, const Eigen::Vector2f& at) {
  const float left = at.x() + kFirst;
  const float top = at.y() + kFirst;
  const auto column = static_cast<int>(left);
  const auto row = static_cast<int>(top);
  const float u = left - static_cast<float>(column);
  const float v = top - static_cast<float>(row);
  const auto between_columns = [&](int y) -> Eigen::Vector4f {
    const std::uint8_t* from = image.ptr<std::uint8_t>(row + y) + column;
    const Eigen::Vector4f here(from[0], from[1], from[2], from[3]);
    const Eigen::Vector4f next(from[1], from[2], from[3], from[4]);
    return (1 - u) * here + u * next;
  };
  Square sampled;
  Eigen::Vector4f above = between_columns(0);
  for (int y = 0; y < kSquareSide; ++y) {
    const Eigen::Vector4f below = between_columns(y + 1);
    sampled[static_cast<std::size_t>(y)] = (1 - v) * above + v * below;
    above = below;
  }
  return sampled;
}

std::vector<Surroundings> Prepare(const CameraModel& camera, const cv::Mat& image, float shrink,
                                  std::span<const SeenPoint> points) {
  std::vector<Surroundings> all;
  all.reserve(points.size());
  for (const SeenPoint& point : points) {
    const Eigen::Vector2f at = shrink * point.pixel_a.cast<float>();
    if (!Contains(image, at)) continue;
    Surroundings& seen = all.emplace_back();
    seen.p_a = point.p_a;
    seen.by_unknowns.topLeftCorner<2, 6>() =
        shrink * ProjectionJacobian(camera, point.p_a, point.p_a).cast<float>();
    seen.by_unknowns.bottomRightCorner<2, 2>().setIdentity();
    const Square grey = Sample(image, at);
    const Square left = Sample(image, at - Eigen::Vector2f(1, 0));
    const Square right = Sample(image, at + Eigen::Vector2f(1, 0));
    const Square above = Sample(image, at - Eigen::Vector2f(0, 1));
    const Square below = Sample(image, at + Eigen::Vector2f(0, 1));
    for (std::size_t y = 0; y < kSquareSide; ++y) {
      for (int x = 0; x < kSquareSide; ++x) {
        seen.row[kSquareSide * y + static_cast<std::size_t>(x)] = {
            0.5F * (right[y][x] - left[y][x]), 0.5F * (below[y][x] - above[y][x]), grey[y][x], 1};
      }
    }
  }
  return all;
}

struct Estimate {
  Pose T_b_a;
  float contrast = 0;  // b = (1 + contrast) a + brightness
  float brightness = 0;
};

struct NormalEquations {
  Matrix8f hessian = Matrix8f::Zero();
  Vector8f gradient = Vector8f::Zero();
  double cost = 0;  // mean over the pixels in view
  int num_pixels = 0;
};

NormalEquations LineariseImage(const CameraModel& camera, const cv::Mat& image, float shrink,
                               const std::vector<Surroundings>& all, const Estimate& estimate) {
  constexpr float kHuber = 10;  // grey values: noise and slant stay below, occlusion does not
  NormalEquations normal;
  for (const Surroundings& seen : all) {
    const Eigen::Vector3d p_b = estimate.T_b_a * seen.p_a;
    if (p_b.z() <= 0) continue;
    const Eigen::Vector2f at = shrink * camera.Project(p_b).cast<float>();
    if (!Contains(image, at)) continue;
    Eigen::Matrix4f squares = Eigen::Matrix4f::Zero();
    Eigen::Vector4f errors = Eigen::Vector4f::Zero();
    const Square found = Sample(image, at);
    for (int i = 0; i < kSquarePixels; ++i) {
      const Eigen::Vector4f& row = seen.row[static_cast<std::size_t>(i)];
      const float grey = found[static_cast<std::size_t>(i / kSquareSide)][i % kSquareSide];
      const float error = grey - (1 + estimate.contrast) * row[2] - estimate.brightness;
      const float size = std::abs(error);
      const float weight = size <= kHuber ? 1 : kHuber / size;
      normal.cost += size <= kHuber ? 0.5F * error * error : kHuber * (size - 0.5F * kHuber);
      for (int column = 0; column < 4; ++column) {
        squares.col(column) += (weight * row[column]) * row;
      }
      errors += (weight * error) * row;
    }
    const Matrix48f weighted = squares.lazyProduct(seen.by_unknowns);
    normal.hessian += seen.by_unknowns.transpose().lazyProduct(weighted);
    normal.gradient += seen.by_unknowns.transpose().lazyProduct(errors);
    normal.num_pixels += kSquarePixels;
  }
  if (normal.num_pixels > 0) normal.cost /= normal.num_pixels;
  return normal;
}

// The unknowns of image a are moved (inverse compositional), so the motion takes the inverse step.
Estimate Moved(const Estimate& estimate, const Vector8f& step) {
  const Eigen::Matrix<double, 8, 1> s = step.cast<double>();
  const Pose a_moved(RotationExp(s.head<3>()), s.segment<3>(3));
  return {estimate.T_b_a * a_moved.Inverse(), estimate.contrast + step[6],
          estimate.brightness + step[7]};
}

void AlignOctave(const CameraModel& camera, const cv::Mat& image, float shrink,
                 const std::vector<Surroundings>& all, Estimate& estimate) {
  constexpr int kMaxSteps = 10;        // a bound: the cost ends it before
  constexpr int kMinPoints = 10;       // eight unknowns, and 16 px of each point
  constexpr double kConverged = 1e-3;  // share of the cost
  NormalEquations normal = LineariseImage(camera, image, shrink, all, estimate);
  for (int i = 0; i < kMaxSteps; ++i) {
    if (normal.num_pixels < kMinPoints * kSquarePixels) return;
    Matrix8f hessian = normal.hessian;
    hessian.diagonal() *= 1 + 1e-4F;
    Vector8f step =
        hessian.cast<double>().ldlt().solve(normal.gradient.cast<double>()).cast<float>();
    if (!step.allFinite()) return;
    const Estimate moved = Moved(estimate, step);
    NormalEquations next = LineariseImage(camera, image, shrink, all, moved);
    if (!(next.cost < normal.cost)) return;
    const bool converged = normal.cost - next.cost < kConverged * normal.cost;
    estimate = moved;
    normal = next;
    if (converged) return;
  }
}

}  // namespace

Pose AlignImages(const CameraModel& camera, const Octaves& a, std::span<const SeenPoint> points,
                 const Octaves& b, const Pose& T_b_a) {
  Estimate estimate{T_b_a, 0, 0};
  const auto num_octaves = static_cast<int>(std::min(a.size(), b.size()));
  if (num_octaves == 0) return T_b_a;
  for (int octave = num_octaves - 1; octave >= std::min(kFinestOctave, num_octaves - 1); --octave) {
    const auto index = static_cast<std::size_t>(octave);
    const float shrink = std::ldexp(1.0F, -octave);
    AlignOctave(camera, b[index], shrink, Prepare(camera, a[index], shrink, points), estimate);
  }
  return estimate.T_b_a;
}

}  // namespace mono3d::tracking
