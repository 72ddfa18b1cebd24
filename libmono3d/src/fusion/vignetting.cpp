// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/vignetting.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/clamped_int.h"
#include "fusion/state_archive.h"
#include "mono3d/core/log.h"
#include "mono3d/core/statistics.h"
#include "mono3d/image/frame.h"

namespace mono3d {
namespace {

// Farther back little of the image is seen again.
constexpr std::size_t kMaxViews = 4;
constexpr int kSampleStep_px = 12;  // some 2000 places of 768x448
constexpr int kBlockRadius_px = 3;  // grey values are means of 7x7, of which sharpness is no part
constexpr double kMinGrey = 8;      // of darker ones rounding is a part in ten of the logarithm
constexpr double kDepthTolerance = 0.02;  // of a place that both see
constexpr std::size_t kMinPlaces = 64;
constexpr double kPlaceSigmasPerMedian = 1.4826;
constexpr double kMinLogSigma = 0.005;  // half a grey value of 100
// Light and reflections change alike for neighbours: the places of a pair tell no more than so
// many.
constexpr double kIndependentPlaces = 24;
// One sigma of either coefficient before any image is seen: lenses lose up to half of the light in
// the corners, a quarter of grey values.
constexpr double kCoefficientPrior = 0.3;
constexpr double kMinSigmas = 4;      // of the falloff in the corners, to be taken for one
constexpr double kMinFalloff = 0.02;  // of grey values; less is lost in rounding

// What two views say of one place.
struct SamePlace {
  Eigen::Vector2d radii;  // differences of r^2 and r^4
  double log_ratio;
};

// In halves of the diagonal, squared.
double RadiusSquare(const CameraModel& camera, double x, double y) {
  const double dx = x - camera.cx;
  const double dy = y - camera.cy;
  const double width = camera.width;
  const double height = camera.height;
  return 4 * (dx * dx + dy * dy) / (width * width + height * height);
}

// Logarithm of the mean around a pixel; none at the border, or where a value is clipped.
std::optional<double> LogGrey(const cv::Mat& grey, int x, int y) {
  if (x < kBlockRadius_px || y < kBlockRadius_px || x + kBlockRadius_px >= grey.cols ||
      y + kBlockRadius_px >= grey.rows) {
    return std::nullopt;
  }
  int sum = 0;
  for (int v = y - kBlockRadius_px; v <= y + kBlockRadius_px; ++v) {
    const auto* row = grey.ptr<std::uint8_t>(v);
    for (int u = x - kBlockRadius_px; u <= x + kBlockRadius_px; ++u) {
      if (row[u] == 0 || row[u] == 255) return std::nullopt;
      sum += row[u];
    }
  }
  constexpr int kSide = 2 * kBlockRadius_px + 1;
  const double mean = static_cast<double>(sum) / (kSide * kSide);
  return mean < kMinGrey ? std::nullopt : std::optional(std::log(mean));
}

// Solves for a, b and the gain of the pair, with weights of Geman and McClure; adds what is left
// for a and b once the gain is eliminated.
void AddPair(const std::vector<SamePlace>& places, const Eigen::Vector2d& coefficients,
             Eigen::Matrix2d& information, Eigen::Vector2d& right) {
  std::vector<double> residuals;
  for (const SamePlace& place : places) {
    residuals.push_back(place.log_ratio - coefficients.dot(place.radii));
  }
  const double gain = Quantile(residuals, 0.5);
  std::vector<double> magnitudes;
  for (const double residual : residuals) magnitudes.push_back(std::abs(residual - gain));
  const double sigma =
      std::max(kPlaceSigmasPerMedian * Quantile(std::move(magnitudes), 0.5), kMinLogSigma);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sums = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double in_scale = (residuals[i] - gain) / (2 * sigma);
    const double root = 1 / (1 + in_scale * in_scale);
    const Eigen::Vector3d row(places[i].radii.x(), places[i].radii.y(), 1);
    normal += root * root * row * row.transpose();
    sums += root * root * places[i].log_ratio * row;
  }
  const double share = std::min(1.0, kIndependentPlaces / static_cast<double>(places.size()));
  const double scale = share / (sigma * sigma);
  const Eigen::Vector2d with_gain = normal.topRightCorner<2, 1>();
  information +=
      scale * (normal.topLeftCorner<2, 2>() - with_gain * with_gain.transpose() / normal(2, 2));
  right += scale * (sums.head<2>() - with_gain * sums(2) / normal(2, 2));
}

Eigen::Matrix2d WithCoefficientPrior(const Eigen::Matrix2d& information) {
  return information + Eigen::Matrix2d::Identity() / (kCoefficientPrior * kCoefficientPrior);
}

}  // namespace

void Vignetting::Add(const DepthMap& map, const Similarity& S_world_kf) {
  if (map.bgr.empty()) return;
  View now{map.camera, S_world_kf, ToGrey(map.bgr), map.depth};
  const std::vector<Sample> samples = SamplesOf(now);
  for (const View& before : views_) Compare(now, samples, before);
  if (IsKnown()) {
    Log(LogLevel::kDebug, "vignetting: corners have " +
                              std::to_string(std::exp(Coefficients().sum())) +
                              " of the grey value of the middle");
  }
  views_.push_back(std::move(now));
  if (views_.size() > kMaxViews) views_.pop_front();
}

std::vector<Vignetting::Sample> Vignetting::SamplesOf(const View& view) {
  std::vector<Sample> samples;
  for (int y = 0; y < view.depth.rows; y += kSampleStep_px) {
    for (int x = 0; x < view.depth.cols; x += kSampleStep_px) {
      const float z = view.depth.at<float>(y, x);
      if (!std::isfinite(z) || z <= 0) continue;
      const std::optional<double> log_grey = LogGrey(view.grey, x, y);
      if (!log_grey) continue;
      samples.push_back(
          {double{z} * view.camera.Unproject({x, y}), *log_grey, RadiusSquare(view.camera, x, y)});
    }
  }
  return samples;
}

void Vignetting::Compare(const View& now, const std::vector<Sample>& samples, const View& before) {
  const Similarity S_before_now = before.S_world_kf.Inverse() * now.S_world_kf;
  std::vector<SamePlace> places;
  for (const Sample& sample : samples) {
    const Eigen::Vector3d p = S_before_now * sample.p_cam;
    if (p.z() <= 0) continue;
    const double u = before.camera.fx * p.x() / p.z() + before.camera.cx;
    const double v = before.camera.fy * p.y() / p.z() + before.camera.cy;
    if (!(u >= 0 && v >= 0 && u < before.depth.cols - 1 && v < before.depth.rows - 1)) continue;
    const auto column = static_cast<int>(std::lround(u));
    const auto row = static_cast<int>(std::lround(v));
    const double seen = before.depth.at<float>(row, column);
    if (!(std::abs(seen - p.z()) < kDepthTolerance * p.z())) continue;
    const std::optional<double> log_before = LogGrey(before.grey, column, row);
    if (!log_before) continue;
    const double r2 = sample.radius_square;
    const double r2_before = RadiusSquare(before.camera, u, v);
    places.push_back(
        {{r2 - r2_before, r2 * r2 - r2_before * r2_before}, sample.log_grey - *log_before});
  }
  if (places.size() >= kMinPlaces) AddPair(places, Coefficients(), information_, right_);
}

Eigen::Vector2d Vignetting::Coefficients() const {
  return WithCoefficientPrior(information_).ldlt().solve(right_);
}

bool Vignetting::IsKnown() const {
  const Eigen::Vector2d corner(1, 1);
  const double falloff = corner.dot(Coefficients());
  const double variance = corner.dot(WithCoefficientPrior(information_).inverse() * corner);
  return falloff < -kMinFalloff && falloff * falloff > kMinSigmas * kMinSigmas * variance;
}

double Vignetting::FalloffAt(const CameraModel& camera, double x, double y) const {
  const double r2 = RadiusSquare(camera, x, y);
  return std::exp(Coefficients().dot(Eigen::Vector2d(r2, r2 * r2)));
}

cv::Mat Vignetting::Corrected(const cv::Mat& bgr, const CameraModel& camera) const {
  if (bgr.empty() || !IsKnown()) return bgr;
  // 256ths of the factor by the square of the radius: no step is a grey value.
  constexpr std::size_t kSteps = 512;
  constexpr double kMaxRadiusSquare = 2;
  const Eigen::Vector2d coefficients = Coefficients();
  std::array<int, kSteps + 1> factors{};
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const double r2 = kMaxRadiusSquare * static_cast<double>(i) / kSteps;
    const double falloff = std::exp(coefficients.dot(Eigen::Vector2d(r2, r2 * r2)));
    factors[i] = static_cast<int>(std::lround(256 / std::clamp(falloff, 0.25, 1.0)));
  }
  cv::Mat corrected(bgr.size(), CV_8UC3);
  for (int y = 0; y < bgr.rows; ++y) {
    const auto* from = bgr.ptr<cv::Vec3b>(y);
    auto* to = corrected.ptr<cv::Vec3b>(y);
    for (int x = 0; x < bgr.cols; ++x) {
      const double step = RadiusSquare(camera, x, y) * (kSteps / kMaxRadiusSquare);
      const auto nearest = static_cast<std::size_t>(ClampedInt(step, 0, kSteps));
      const int factor = factors[nearest];
      for (int channel = 0; channel < 3; ++channel) {
        const int value = (from[x][channel] * factor + 128) >> 8;
        to[x][channel] = static_cast<std::uint8_t>(std::min(value, 255));
      }
    }
  }
  return corrected;
}

template <typename Archive>
void Vignetting::Exchange(Archive& archive) {
  ExchangeMatrix(archive, information_);
  ExchangeMatrix(archive, right_);
  std::uint64_t num_views = views_.size();
  archive.Number(num_views);
  RequireSound(archive, num_views <= kMaxViews);
  if constexpr (kIsReader<Archive>) views_.resize(num_views);
}

template <typename Archive>
void Vignetting::ExchangeView(Archive& archive, std::size_t number) {
  View& view = views_[number];
  ExchangeCamera(archive, view.camera);
  ExchangeSimilarity(archive, view.S_world_kf);
  ExchangeImage(archive, view.grey, CV_8UC1, view.camera);
  ExchangeImage(archive, view.depth, CV_32FC1, view.camera);
  RequireSound(archive, !view.grey.empty() && !view.depth.empty());
}

template void Vignetting::Exchange(ByteWriter& archive);
template void Vignetting::Exchange(ByteReader& archive);
template void Vignetting::ExchangeView(ByteWriter& archive, std::size_t number);
template void Vignetting::ExchangeView(ByteReader& archive, std::size_t number);

}  // namespace mono3d
