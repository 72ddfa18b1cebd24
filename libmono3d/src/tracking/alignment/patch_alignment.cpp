// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/patch_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/clamped_int.h"

namespace mono3d::tracking {
namespace {

constexpr int kHalf = 4;  // px: 9 x 9, enough texture to tell a corner from its neighbours
constexpr int kSide = 2 * kHalf + 1;
constexpr int kNumPixels = kSide * kSide;
constexpr int kBorderedSide = kSide + 2;  // for the gradients
constexpr int kNoise = 2;                 // grey values, assumed of the camera

// A row of the window and what follows up to a multiple of four: the processor's vectors. What
// follows counts nothing: it is zero in the template.
constexpr int kRowLength = 12;
using Row = Eigen::Array<float, kRowLength, 1>;
using Pixels = std::array<Row, kSide>;

// Ones for the window, zeros for what follows.
Row InWindow() {
  Row row = Row::Zero();
  row.head<kSide>().setOnes();
  return row;
}

// The patch as the other image should show it, zero mean, with its gradients (zero mean too).
struct Template {
  Pixels value;
  Pixels by_x;
  Pixels by_y;
  float norm = 0;  // of `value`
  Eigen::Matrix2f inverse_hessian;
};

float Product(const Pixels& a, const Pixels& b) {
  Row sum = Row::Zero();
  for (std::size_t y = 0; y < kSide; ++y) sum += a[y] * b[y];
  return sum.sum();
}

// Subtracts the mean and returns the norm of what remains.
float Centre(Pixels& pixels) {
  Row sum = Row::Zero();
  for (const Row& row : pixels) sum += row;
  const Row mean = sum.sum() / kNumPixels * InWindow();
  for (Row& row : pixels) row -= mean;
  return std::sqrt(Product(pixels, pixels));
}

// Samples the patch at the pixels of the target octave. `step`: patch pixels per target pixel.
std::optional<Template> MakeTemplate(const Patch& patch, const Eigen::Matrix2f& step) {
  constexpr int kReach = kHalf + 1;
  const float reach_x = kReach * (std::abs(step(0, 0)) + std::abs(step(0, 1)));
  const float reach_y = kReach * (std::abs(step(1, 0)) + std::abs(step(1, 1)));
  constexpr float kLast = Patch::kSide - 1;
  const Eigen::Vector2f& centre = patch.centre;
  // Not the opposite of it, which a number that is none would pass.
  const bool lies_within = centre.x() >= reach_x && centre.x() + reach_x < kLast &&
                           centre.y() >= reach_y && centre.y() + reach_y < kLast;
  if (!lies_within) return std::nullopt;
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
    result.value[row].setZero();
    result.by_x[row].setZero();
    result.by_y[row].setZero();
    for (int column = 0; column < kSide; ++column) {
      const float* from =
          &bordered[(row + 1) * kBorderedSide + static_cast<std::size_t>(column) + 1];
      result.value[row][column] = from[0];
      result.by_x[row][column] = 0.5F * (from[1] - from[-1]);
      result.by_y[row][column] = 0.5F * (from[kBorderedSide] - *(from - kBorderedSide));
    }
  }
  result.norm = Centre(result.value);
  Centre(result.by_x);
  Centre(result.by_y);
  Eigen::Matrix2f hessian;
  hessian(0, 0) = Product(result.by_x, result.by_x);
  hessian(0, 1) = Product(result.by_x, result.by_y);
  hessian(1, 0) = hessian(0, 1);
  hessian(1, 1) = Product(result.by_y, result.by_y);
  // Noise must leave the position sure to a quarter of a pixel.
  constexpr float kMinEigenvalue = 16 * kNoise * kNoise;
  const float half_trace = 0.5F * hessian.trace();
  const float root = std::sqrt(std::max(0.0F, half_trace * half_trace - hessian.determinant()));
  if (half_trace - root < kMinEigenvalue) return std::nullopt;
  result.inverse_hessian = hessian.inverse();
  return result;
}

// The image around `at`, one bilinear weight for all pixels; false outside the image.
bool SamplePatch(const cv::Mat& image, const Eigen::Vector2f& at, Pixels& pixels) {
  const float left = at.x() - kHalf;
  const float top = at.y() - kHalf;
  // Before they become integers: a step of the alignment may end anywhere.
  const bool lies_within = left >= 0 && left < static_cast<float>(image.cols - kSide) && top >= 0 &&
                           top < static_cast<float>(image.rows - kSide);
  if (!lies_within) return false;
  const auto column = static_cast<int>(left);
  const auto row = static_cast<int>(top);
  const float u = left - static_cast<float>(column);
  const float v = top - static_cast<float>(row);
  const Row in_window = InWindow();
  const Row w00 = (1 - u) * (1 - v) * in_window;
  const Row w01 = u * (1 - v) * in_window;
  const Row w10 = (1 - u) * v * in_window;
  const Row w11 = u * v * in_window;
  std::array<float, kRowLength + 1> above{};
  std::array<float, kRowLength + 1> below{};
  const auto read = [&](int y) {
    const std::uint8_t* from = image.ptr<std::uint8_t>(row + y) + column;
    for (std::size_t x = 0; x <= kSide; ++x) below[x] = static_cast<float>(from[x]);
  };
  read(0);
  for (int y = 0; y < kSide; ++y) {
    above = below;
    read(y + 1);
    const Eigen::Map<const Row> a0(above.data());
    const Eigen::Map<const Row> a1(above.data() + 1);
    const Eigen::Map<const Row> b0(below.data());
    const Eigen::Map<const Row> b1(below.data() + 1);
    pixels[static_cast<std::size_t>(y)] = w00 * a0 + w01 * a1 + w10 * b0 + w11 * b1;
  }
  return true;
}

// Standard deviation of the place in x and in y, px of the octave, by the noise that is left
// between template and image at equal brightness and contrast.
float PlaceSigma(const Template& to_find, float correlation) {
  // Interpolation between the pixels takes the rest of the variance out of the difference, in the
  // mean over all places; the slow part of the noise, which moves the patch, stays.
  constexpr float kVarianceLeft = 4.0F / 9;
  constexpr int kNumFitted = 4;  // brightness, contrast, place
  const float squared_difference =
      2 * to_find.norm * to_find.norm * std::max(0.0F, 1 - correlation);
  const float variance = squared_difference / (kNumPixels - kNumFitted) / kVarianceLeft;
  return std::sqrt(variance * to_find.inverse_hessian.trace() / 2);
}

// On which `warp` makes the patch neither finer nor coarser. Nothing where it mirrors it.
std::optional<int> OctaveFor(const Patch& patch, const Eigen::Matrix2d& warp,
                             const Octaves& octaves) {
  const double determinant = warp.determinant();
  if (!(determinant > 0)) return std::nullopt;
  const double scale = std::sqrt(determinant) * std::ldexp(1.0, patch.octave);
  return ClampedInt(std::round(std::log2(scale)), 0, static_cast<int>(octaves.size()) - 1);
}

// The difference between a patch and the image, linear in: the contrast, the place in x and y, the
// normal in x and y.
struct PatchEquations {
  Eigen::Matrix<double, 5, 5> hessian = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> gradient = Eigen::Matrix<double, 5, 1>::Zero();
  double squared_error = 0;
};

// `pixels`: zero mean, the contrast of the patch. `lever`: by_normal of the warp, and `to_patch`:
// px of the patch's full image, both per px of the octave.
PatchEquations Linearise(const Template& to_find, const Pixels& pixels,
                         const Eigen::Vector2d& lever, const Eigen::Matrix2d& to_patch) {
  PatchEquations equations;
  Eigen::Matrix<double, 5, 1> mean = Eigen::Matrix<double, 5, 1>::Zero();
  for (int y = -kHalf; y <= kHalf; ++y) {
    const auto row = static_cast<std::size_t>(y + kHalf);
    for (int x = -kHalf; x <= kHalf; ++x) {
      const double value = to_find.value[row][x + kHalf];
      const double by_x = to_find.by_x[row][x + kHalf];
      const double by_y = to_find.by_y[row][x + kHalf];
      const double error = value - static_cast<double>(pixels[row][x + kHalf]);
      const Eigen::Vector2d by_normal =
          (by_x * lever.x() + by_y * lever.y()) * (to_patch * Eigen::Vector2d(x, y));
      Eigen::Matrix<double, 5, 1> J;
      J << value, by_x, by_y, by_normal;
      equations.hessian.noalias() += J * J.transpose();
      equations.gradient += error * J;
      equations.squared_error += error * error;
      mean += J / kNumPixels;
    }
  }
  equations.hessian -= kNumPixels * mean * mean.transpose();  // whatever the brightness
  return equations;
}

}  // namespace

std::optional<Patch> TakePatch(const Octaves& octaves, const Eigen::Vector2d& pixel, int octave) {
  if (octave >= static_cast<int>(octaves.size())) return std::nullopt;
  const cv::Mat& image = octaves[static_cast<std::size_t>(octave)];
  const Eigen::Vector2d at = std::ldexp(1.0, -octave) * pixel;
  const int column = ClampedInt(std::round(at.x()), -1, image.cols) - Patch::kRadius;
  const int row = ClampedInt(std::round(at.y()), -1, image.rows) - Patch::kRadius;
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

std::optional<PatchWarp> WarpPatch(const CameraModel& camera, const Pose& T_b_a,
                                   const Eigen::Vector2d& pixel_a, double z_a,
                                   const Eigen::Vector2d& normal) {
  const Eigen::Matrix3d R = T_b_a.rotation().toRotationMatrix();
  const Eigen::Vector3d along_ray = z_a * (R * camera.Unproject(pixel_a));
  const Eigen::Vector3d p_b = along_ray + T_b_a.translation();
  if (p_b.z() <= 0) return std::nullopt;
  Eigen::Matrix<double, 2, 3> projection;
  const double inverse_z = 1 / p_b.z();
  projection << camera.fx * inverse_z, 0, -camera.fx * p_b.x() * inverse_z * inverse_z,  //
      0, camera.fy * inverse_z, -camera.fy * p_b.y() * inverse_z * inverse_z;
  // At pixel u the plane is at ray(u) / (1 / z_a * (1 + normal . (u - pixel_a))).
  PatchWarp warp;
  warp.by_normal = -projection * along_ray;
  warp.by_pixel.col(0) = z_a / camera.fx * projection * R.col(0);
  warp.by_pixel.col(1) = z_a / camera.fy * projection * R.col(1);
  warp.by_pixel += warp.by_normal * normal.transpose();
  return warp;
}

std::optional<PatchPosition> AlignPatch(const Patch& patch, const Eigen::Matrix2d& warp,
                                        const Octaves& octaves, const Eigen::Vector2d& start_px,
                                        double max_move) {
  const std::optional<int> octave = OctaveFor(patch, warp, octaves);
  if (!octave) return std::nullopt;
  const double size = std::ldexp(1.0, *octave);
  const Eigen::Matrix2d step = warp.inverse() * std::ldexp(size, -patch.octave);
  const std::optional<Template> to_find = MakeTemplate(patch, step.cast<float>());
  if (!to_find) return std::nullopt;
  const cv::Mat& image = octaves[static_cast<std::size_t>(*octave)];
  const Eigen::Vector2f start = (start_px / size).cast<float>();
  Eigen::Vector2f at = start;
  const Eigen::Vector2f by_value(Product(to_find->by_x, to_find->value),
                                 Product(to_find->by_y, to_find->value));
  Pixels pixels;
  constexpr int kMaxSteps = 12;        // what has not converged by then is not found
  constexpr float kConverged = 0.01F;  // px
  for (int i = 0; i < kMaxSteps; ++i) {
    if (!SamplePatch(image, at, pixels)) return std::nullopt;
    const float norm = Centre(pixels);
    if (norm < 1) return std::nullopt;
    // All have zero mean, and what the template would give is the same in each step.
    const float gain = to_find->norm / norm;
    const Eigen::Vector2f gradient(gain * Product(to_find->by_x, pixels) - by_value.x(),
                                   gain * Product(to_find->by_y, pixels) - by_value.y());
    const Eigen::Vector2f move = to_find->inverse_hessian * gradient;
    at -= move;
    if (!((at - start).squaredNorm() <= max_move * max_move)) return std::nullopt;
    if (move.squaredNorm() < kConverged * kConverged) {
      const float correlation = Product(to_find->value, pixels) / (norm * to_find->norm);
      return PatchPosition{size * at.cast<double>(), *octave, correlation,
                           size * PlaceSigma(*to_find, correlation)};
    }
  }
  return std::nullopt;
}

std::optional<NormalEvidence> MeasureNormal(const Patch& patch, const PatchWarp& warp,
                                            const Octaves& octaves, const Eigen::Vector2d& at_px) {
  const std::optional<int> octave = OctaveFor(patch, warp.by_pixel, octaves);
  if (!octave) return std::nullopt;
  const double size = std::ldexp(1.0, *octave);
  const Eigen::Matrix2d to_patch = size * warp.by_pixel.inverse();
  const Eigen::Matrix2d step = std::ldexp(1.0, -patch.octave) * to_patch;
  const std::optional<Template> to_find = MakeTemplate(patch, step.cast<float>());
  Pixels pixels;
  if (!to_find || !SamplePatch(octaves[static_cast<std::size_t>(*octave)],
                               (at_px / size).cast<float>(), pixels)) {
    return std::nullopt;
  }
  const float norm = Centre(pixels);
  if (norm < 1) return std::nullopt;
  for (Row& row : pixels) row *= to_find->norm / norm;
  const PatchEquations all = Linearise(*to_find, pixels, warp.by_normal / size, to_patch);
  // Without contrast and place.
  const Eigen::Matrix<double, 2, 3> through =
      all.hessian.bottomLeftCorner<2, 3>() * all.hessian.topLeftCorner<3, 3>().inverse();
  const double variance = std::max<double>(kNoise * kNoise, all.squared_error / (kNumPixels - 6));
  NormalEvidence evidence;
  evidence.information =
      (all.hessian.bottomRightCorner<2, 2>() - through * all.hessian.topRightCorner<3, 2>()) /
      variance;
  evidence.weighted_normal = evidence.information * patch.normal.value +
                             (all.gradient.tail<2>() - through * all.gradient.head<3>()) / variance;
  if (!evidence.information.allFinite() || !evidence.weighted_normal.allFinite())
    return std::nullopt;
  return evidence;
}

}  // namespace mono3d::tracking
