// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/refinement_reference.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace mono3d::reference {
namespace {

double Pixel(const cv::Mat& image, int x, int y) {
  return image.at<std::uint8_t>(std::clamp(y, 0, image.rows - 1), std::clamp(x, 0, image.cols - 1));
}

// Bilinear, outside the image its border.
double Interpolate(const cv::Mat& image, double x, double y) {
  const int left = static_cast<int>(std::floor(x));
  const int top = static_cast<int>(std::floor(y));
  const double u = x - left;
  const double v = y - top;
  return (1 - v) * ((1 - u) * Pixel(image, left, top) + u * Pixel(image, left + 1, top)) +
         v * ((1 - u) * Pixel(image, left, top + 1) + u * Pixel(image, left + 1, top + 1));
}

}  // namespace

cv::Mat Detail(const cv::Mat& grey, const cv::Mat& quarter, double gain) {
  cv::Mat detail(grey.size(), CV_8UC1);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const double mean = Interpolate(quarter, (x + 0.5) / 4 - 0.5, (y + 0.5) / 4 - 0.5);
      const double value = std::floor(gain * (Pixel(grey, x, y) - mean) + 0.5) + 128;
      detail.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    }
  }
  return detail;
}

std::vector<Eigen::Vector4f> PhotometricStep(const std::vector<cv::Mat>& detail,
                                             const SourceProjections& projections,
                                             const std::vector<float>& inverse_depth,
                                             const PhotometricParams& params) {
  std::vector<Eigen::Vector4f> result;
  const int width = static_cast<int>(params.width_px);
  const int height = static_cast<int>(params.height_px);
  const double noise = 2.0 * double(params.noise) * double(params.noise);
  for (std::size_t i = 0; i < inverse_depth.size(); ++i) {
    const int x = static_cast<int>(i) % width;
    const int y = static_cast<int>(i) / width;
    const auto w = double(inverse_depth[i]);
    double gradient = 0, information = 0, support = 0;
    int num_visible = 0;
    for (std::size_t s = 0; s < projections.size(); ++s) {
      const auto at = [&](double of) -> Eigen::Vector3d {
        return projections[s].A * Eigen::Vector3d(x, y, 1) + of * projections[s].b;
      };
      const Eigen::Vector2d u = at(w).hnormalized();
      if (at(w).z() <= 0 || u.x() < 0 || u.y() < 0 || u.x() >= width - 1 || u.y() >= height - 1) {
        continue;
      }
      if (!projections[s].bounds.Contain(u) || !projections[s].reference.Contain({x, y})) continue;
      const cv::Mat& image = detail[s + 1];
      const double left = std::floor(u.x());
      const double top = std::floor(u.y());
      const Eigen::Vector2d slope(
          Interpolate(image, left + 1, u.y()) - Interpolate(image, left, u.y()),
          Interpolate(image, u.x(), top + 1) - Interpolate(image, u.x(), top));
      const Eigen::Vector3d& b = projections[s].b;
      const Eigen::Vector2d motion = (b.head<2>() - b.z() * u) / at(w).z();
      const double jacobian = slope.dot(motion) * double(params.inverse_depth_step);
      const double residual = Interpolate(image, u.x(), u.y()) - Pixel(detail[0], x, y);
      const double variance = noise + jacobian * jacobian / 9;
      const double weight = std::pow(variance / (variance + residual * residual), 2);
      gradient += weight * jacobian * residual;
      information += weight * jacobian * jacobian;
      support += weight;
      ++num_visible;
    }
    if (w <= 0 || num_visible < int(params.min_views)) {
      result.emplace_back(Eigen::Vector4f::Zero());
      continue;
    }
    const double step = std::clamp(-gradient / (information + noise), -1.0, 1.0);
    result.emplace_back(float(w), float(w + step * double(params.inverse_depth_step)),
                        float(information / noise + 1), float(support / std::max(num_visible, 1)));
  }
  return result;
}

Surface FitSurface(const std::vector<Eigen::Vector4f>& measurements,
                   const std::vector<float>& uniqueness, const SurfaceParams& params) {
  constexpr std::array<double, 4> kFalloff = {1.0, 0.8007, 0.4111, 0.1353};
  const int width = static_cast<int>(params.width_px);
  const int height = static_cast<int>(params.height_px);
  const auto step = double(params.inverse_depth_step);
  const auto depth_at = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= width || y >= height) return 0.0;
    return double(measurements[static_cast<std::size_t>(y * width + x)].x());
  };
  Surface surface;
  for (int i = 0; i < width * height; ++i) {
    const auto middle = double(measurements[static_cast<std::size_t>(i)].x());
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double squares = 0, support = 0, nearest = 0, farthest = 1e9, num_found = 0;
    for (int dy = -3; dy <= 3; ++dy) {
      for (int dx = -3; dx <= 3; ++dx) {
        const int x = i % width + dx;
        const int y = i / width + dy;
        if (x < 0 || y < 0 || x >= width || y >= height) continue;
        const Eigen::Vector4d m =
            measurements[static_cast<std::size_t>(y * width + x)].cast<double>();
        num_found += m.x() > 0 ? 1 : 0;
        if (m.x() > 0 && std::max(std::abs(dx), std::abs(dy)) <= 2) {
          nearest = std::max(nearest, m.x());
          farthest = std::min(farthest, m.x());
        }
        if (m.x() <= 0 ||
            std::abs(m.x() - middle) / step > std::max({std::abs(dx), std::abs(dy), 1})) {
          continue;
        }
        const double falloff = kFalloff[static_cast<std::size_t>(std::abs(dx))] *
                               kFalloff[static_cast<std::size_t>(std::abs(dy))];
        const Eigen::Vector3d row(1, dx, dy);
        const double v = (m.y() - middle) / step;
        A += falloff * m.z() * row * row.transpose();
        b += falloff * m.z() * v * row;
        squares += falloff * m.z() * v * v;
        support += falloff * m.w();
      }
    }
    double w = middle, confidence = 0;
    const double determinant = A.determinant() * A(0, 0);
    const double cxx = A(0, 0) * A(1, 1) - A(0, 1) * A(0, 1);
    const double cyy = A(0, 0) * A(2, 2) - A(0, 2) * A(0, 2);
    if (middle > 0 && cxx > 0 && cyy > 0 && determinant > 1e-3 * cxx * cyy) {
      const Eigen::Vector3d g = A.ldlt().solve(b);
      w = std::max(middle + step * std::clamp(g.x(), -1.0, 1.0), 0.5 * middle);
      const double misfit = std::max(squares - g.dot(b), 0.0);
      double deviation = std::sqrt((1 + misfit) / A(0, 0)) * step + (nearest - farthest) / 4;
      for (const auto& [dx, dy] :
           {std::pair(3, 0), std::pair(0, 3), std::pair(3, 3), std::pair(3, -3)}) {
        const double before = depth_at(i % width - dx, i / width - dy);
        const double after = depth_at(i % width + dx, i / width + dy);
        if (before > 0 && after > 0) deviation += std::abs((before + after) / 2 - middle);
      }
      const double u = double(uniqueness[static_cast<std::size_t>(i)]);
      const double evidence = num_found / 49 * std::sqrt(support / 13.6686 * u);
      const double error = 0.5 * ((1 + deviation / (0.01 * w)) / evidence - 1);
      confidence = 1 / (1 + error);
    }
    surface.inverse_depth.push_back(float(w));
    surface.confidence.push_back(middle > 0 ? float(std::clamp(confidence, 1e-3, 1.0)) : 0.f);
  }
  return surface;
}

}  // namespace mono3d::reference
