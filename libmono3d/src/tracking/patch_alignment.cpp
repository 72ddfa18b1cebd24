// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/patch_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace mono3d::tracking {
namespace {

constexpr int kHalf = 4;
constexpr int kSide = 2 * kHalf + 1;
constexpr int kNumPixels = kSide * kSide;
constexpr int kBorderedSide = kSide + 2;  // for the gradients

using Pixels = std::array<float, kNumPixels>;

// The patch as the other image should show it, zero mean, with its gradients (zero mean too).
struct Template {
  Pixels value{};
  Pixels by_x{};
  Pixels by_y{};
  float norm = 0;  // of `value`
  Eigen::Matrix2f inverse_hessian;
};

// Subtracts the mean and returns the norm of what remains.
float Centre(Pixels& pixels) {
  float sum = 0;
  for (const float p : pixels) sum += p;
  const float mean = sum / kNumPixels;
  float squares = 0;
  for (float& p : pixels) {
    p -= mean;
    squares += p * p;
  }
  return std::sqrt(squares);
}

// Samples the patch at the pixels of the target octave. `step`: patch pixels per target pixel.
std::optional<Template> MakeTemplate(const Patch& patch, const Eigen::Matrix2f& step) {
  constexpr int kReach = kHalf + 1;
  const float reach_x = kReach * (std::abs(step(0, 0)) + std::abs(step(0, 1)));
  const float reach_y = kReach * (std::abs(step(1, 0)) + std::abs(step(1, 1)));
  constexpr float kLast = Patch::kSide - 1;
  const Eigen::Vector2f& centre = patch.centre;
  if (centre.x() < reach_x || centre.x() + reach_x >= kLast || centre.y() < reach_y ||
      centre.y() + reach_y >= kLast) {
    return std::nullopt;
  }
  const cv::Mat grey(Patch::kSide, Patch::kSide, CV_8UC1,
                     const_cast<std::uint8_t*>(patch.grey.data()));  // only read
  std::array<float, kBorderedSide * kBorderedSide> bordered{};
  std::size_t next = 0;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      const Eigen::Vector2f at = centre + step * Eigen::Vector2f(dx, dy);
      bordered[next++] = Interpolate(grey, at.x(), at.y());
    }
  }
  Template result;
  for (std::size_t row = 0; row < kSide; ++row) {
    for (std::size_t column = 0; column < kSide; ++column) {
      const std::size_t to = row * kSide + column;
      const float* from = &bordered[(row + 1) * kBorderedSide + column + 1];
      result.value[to] = from[0];
      result.by_x[to] = 0.5F * (from[1] - from[-1]);
      result.by_y[to] = 0.5F * (from[kBorderedSide] - *(from - kBorderedSide));
    }
  }
  result.norm = Centre(result.value);
  Centre(result.by_x);
  Centre(result.by_y);
  Eigen::Matrix2f hessian = Eigen::Matrix2f::Zero();
  for (std::size_t i = 0; i < kNumPixels; ++i) {
    hessian(0, 0) += result.by_x[i] * result.by_x[i];
    hessian(0, 1) += result.by_x[i] * result.by_y[i];
    hessian(1, 1) += result.by_y[i] * result.by_y[i];
  }
  hessian(1, 0) = hessian(0, 1);
  // Noise of two grey values must leave the position sure to a quarter of a pixel.
  constexpr float kMinEigenvalue = 64;
  const float half_trace = 0.5F * hessian.trace();
  const float root = std::sqrt(std::max(0.0F, half_trace * half_trace - hessian.determinant()));
  if (half_trace - root < kMinEigenvalue) return std::nullopt;
  result.inverse_hessian = hessian.inverse();
  return result;
}

// The image around `at`, one bilinear weight for all pixels; false outside the image.
bool Sample(const cv::Mat& image, const Eigen::Vector2f& at, Pixels& pixels) {
  const float left = at.x() - kHalf;
  const float top = at.y() - kHalf;
  if (!(left >= 0) || !(top >= 0)) return false;
  const auto column = static_cast<int>(left);
  const auto row = static_cast<int>(top);
  if (column + kSide >= image.cols || row + kSide >= image.rows) return false;
  const float u = left - static_cast<float>(column);
  const float v = top - static_cast<float>(row);
  const float w00 = (1 - u) * (1 - v);
  const float w01 = u * (1 - v);
  const float w10 = (1 - u) * v;
  const float w11 = u * v;
  std::size_t next = 0;
  for (int y = 0; y < kSide; ++y) {
    const std::uint8_t* above = image.ptr<std::uint8_t>(row + y) + column;
    const std::uint8_t* below = above + image.step[0];
    for (int x = 0; x < kSide; ++x) {
      pixels[next++] = w00 * static_cast<float>(above[x]) + w01 * static_cast<float>(above[x + 1]) +
                       w10 * static_cast<float>(below[x]) + w11 * static_cast<float>(below[x + 1]);
    }
  }
  return true;
}

}  // namespace

std::optional<Patch> TakePatch(const Octaves& octaves, const Eigen::Vector2d& pixel, int octave) {
  if (octave >= static_cast<int>(octaves.size())) return std::nullopt;
  const cv::Mat& image = octaves[static_cast<std::size_t>(octave)];
  const Eigen::Vector2d at = std::ldexp(1.0, -octave) * pixel;
  const auto column = static_cast<int>(std::lround(at.x())) - Patch::kRadius;
  const auto row = static_cast<int>(std::lround(at.y())) - Patch::kRadius;
  if (column < 0 || row < 0 || column + Patch::kSide > image.cols ||
      row + Patch::kSide > image.rows) {
    return std::nullopt;
  }
  Patch patch;
  patch.pixel = pixel;
  patch.octave = octave;
  patch.centre = (at - Eigen::Vector2d(column, row)).cast<float>();
  for (int y = 0; y < Patch::kSide; ++y) {
    const std::uint8_t* from = image.ptr<std::uint8_t>(row + y) + column;
    std::copy(from, from + Patch::kSide, patch.grey.begin() + y * Patch::kSide);
  }
  return patch;
}

std::optional<Eigen::Matrix2d> PatchWarp(const CameraModel& camera, const Pose& T_b_a,
                                         const Eigen::Vector2d& pixel_a, double z_a) {
  const Eigen::Vector3d ray = camera.Unproject(pixel_a);
  const Eigen::Matrix3d R = T_b_a.rotation().toRotationMatrix();
  const Eigen::Vector3d p_b = R * (z_a * ray) + T_b_a.translation();
  if (p_b.z() <= 0) return std::nullopt;
  // The plane through the point across its ray.
  Eigen::Matrix<double, 3, 2> by_pixel;
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();  // d ray / d pixel
    turned[axis] = 1 / (axis == 0 ? camera.fx : camera.fy);
    const Eigen::Vector3d moved = z_a * (turned - ray * ray.dot(turned) / ray.squaredNorm());
    by_pixel.col(axis) = R * moved;
  }
  Eigen::Matrix<double, 2, 3> projection;
  const double inverse_z = 1 / p_b.z();
  projection << camera.fx * inverse_z, 0, -camera.fx * p_b.x() * inverse_z * inverse_z,  //
      0, camera.fy * inverse_z, -camera.fy * p_b.y() * inverse_z * inverse_z;
  return projection * by_pixel;
}

std::optional<PatchPosition> AlignPatch(const Patch& patch, const Eigen::Matrix2d& warp,
                                        const Octaves& octaves, const Eigen::Vector2d& start_px,
                                        double max_move) {
  const double determinant = warp.determinant();
  if (!(determinant > 0)) return std::nullopt;
  const double scale = std::sqrt(determinant) * std::ldexp(1.0, patch.octave);
  const int octave = std::clamp(static_cast<int>(std::lround(std::log2(scale))), 0,
                                static_cast<int>(octaves.size()) - 1);
  const double size = std::ldexp(1.0, octave);
  const Eigen::Matrix2d step = warp.inverse() * std::ldexp(size, -patch.octave);
  const std::optional<Template> to_find = MakeTemplate(patch, step.cast<float>());
  if (!to_find) return std::nullopt;
  const cv::Mat& image = octaves[static_cast<std::size_t>(octave)];
  const Eigen::Vector2f start = (start_px / size).cast<float>();
  Eigen::Vector2f at = start;
  Pixels pixels;
  constexpr int kMaxSteps = 12;
  constexpr float kSettled = 0.01F;  // px
  for (int i = 0; i < kMaxSteps; ++i) {
    if (!Sample(image, at, pixels)) return std::nullopt;
    const float norm = Centre(pixels);
    if (norm < 1) return std::nullopt;
    const float gain = to_find->norm / norm;
    Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
    float product = 0;
    for (std::size_t k = 0; k < kNumPixels; ++k) {
      const float difference = gain * pixels[k] - to_find->value[k];
      gradient.x() += to_find->by_x[k] * difference;
      gradient.y() += to_find->by_y[k] * difference;
      product += to_find->value[k] * pixels[k];
    }
    const Eigen::Vector2f move = to_find->inverse_hessian * gradient;
    at -= move;
    if (!((at - start).squaredNorm() <= max_move * max_move)) return std::nullopt;
    if (move.squaredNorm() < kSettled * kSettled) {
      return PatchPosition{size * at.cast<double>(), octave, product / (norm * to_find->norm)};
    }
  }
  return std::nullopt;
}

}  // namespace mono3d::tracking
