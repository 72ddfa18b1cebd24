// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/cloud_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/evaluation/cloud_search.h"

namespace mono3d::tools {
namespace {

constexpr int kSamplesPerPixel = 2;          // in x and in y, averaged at the end
constexpr float kMaxSplatRadius_px = 16;     // of samples
constexpr std::size_t kSplatNeighbours = 7;  // a point and six around it
constexpr float kSplatShare = 0.7F;          // of the distance of the farthest of them
constexpr float kMaxSplatInMedians = 4;
constexpr int kShadingRadius = 3;  // samples that a slope is fitted to, each way
constexpr float kMaxSlope = 4;     // steeper is an edge
constexpr float kNoSurface = std::numeric_limits<float>::infinity();
constexpr float kAmbientOfColours = 0.6F;  // colours of photographs have the sun's shading already
constexpr float kAmbientOfOneColour = 0.3F;
const cv::Vec3b kColourlessPoint = {200, 200, 200};
const cv::Vec3b kBackground = {255, 255, 255};

// Samples of a picture: what is nearest to the viewer.
struct Canvas {
  cv::Mat depth;    // CV_32F, in samples, kNoSurface where nothing is
  cv::Mat colour;   // CV_8UC3
  cv::Mat ambient;  // CV_32F, share of the light that does not depend on the slope
};

void DrawSplat(Canvas& canvas, const Eigen::Vector3f& at, float radius, const cv::Vec3b& colour,
               float ambient) {
  const int reach = static_cast<int>(std::ceil(radius));
  const int middle_x = static_cast<int>(std::lround(at.x()));
  const int middle_y = static_cast<int>(std::lround(at.y()));
  const int first_x = std::max(0, middle_x - reach);
  const int last_x = std::min(canvas.depth.cols - 1, middle_x + reach);
  const int last_y = std::min(canvas.depth.rows - 1, middle_y + reach);
  for (int y = std::max(0, middle_y - reach); y <= last_y; ++y) {
    for (int x = first_x; x <= last_x; ++x) {
      const float dx = static_cast<float>(x) - at.x();
      const float dy = static_cast<float>(y) - at.y();
      const bool inside = dx * dx + dy * dy <= radius * radius || (x == middle_x && y == middle_y);
      if (!inside || at.z() >= canvas.depth.at<float>(y, x)) continue;
      canvas.depth.at<float>(y, x) = at.z();
      canvas.colour.at<cv::Vec3b>(y, x) = colour;
      canvas.ambient.at<float>(y, x) = ambient;
    }
  }
}

cv::Vec3b ColourOf(const CloudLayer& layer, std::size_t i) {
  if (!layer.values.empty()) return ErrorColour(layer.values[i] / layer.max_value);
  if (layer.colour) return *layer.colour;
  if (layer.cloud->colours.empty()) return kColourlessPoint;
  const auto& [red, green, blue] = layer.cloud->colours[i];
  return {blue, green, red};
}

void DrawLayer(Canvas& canvas, const CloudLayer& layer, std::span<const float> splat_radii,
               const CloudView& view) {
  const double sample_su = view.pixel_su / kSamplesPerPixel;
  const Eigen::Vector3d middle(canvas.depth.cols / 2.0, canvas.depth.rows / 2.0, 0);
  const bool own_colours = layer.values.empty() && !layer.colour && !layer.cloud->colours.empty();
  const float ambient =
      own_colours || !layer.values.empty() ? kAmbientOfColours : kAmbientOfOneColour;
  const Eigen::Array3d limit(canvas.depth.cols, canvas.depth.rows, 0);
  for (std::size_t i = 0; i < layer.cloud->size(); ++i) {
    const Eigen::Vector3d offset = layer.cloud->points[i].cast<double>() - view.centre_world;
    const Eigen::Vector3d at = view.R_view_world * offset / sample_su + middle;
    const float radius =
        std::clamp(static_cast<float>(splat_radii[i] / sample_su), 0.5F, kMaxSplatRadius_px);
    const Eigen::Array2d xy = at.head<2>();
    if ((xy < -radius).any() || (xy > limit.head<2>() + radius).any()) continue;
    DrawSplat(canvas, at.cast<float>(), radius, ColourOf(layer, i), ambient);
  }
}

// How much light falls on the surface around a sample, 1 where it faces the viewer.
float Light(const cv::Mat& depth, int x, int y) {
  const float here = depth.at<float>(y, x);
  float xx = 0;
  float yy = 0;
  float xz = 0;
  float yz = 0;
  for (int dy = -kShadingRadius; dy <= kShadingRadius; ++dy) {
    for (int dx = -kShadingRadius; dx <= kShadingRadius; ++dx) {
      const int at_x = x + dx;
      const int at_y = y + dy;
      if (at_x < 0 || at_y < 0 || at_x >= depth.cols || at_y >= depth.rows) continue;
      const float rise = depth.at<float>(at_y, at_x) - here;
      const auto run_x = static_cast<float>(dx);
      const auto run_y = static_cast<float>(dy);
      const float max_rise = kMaxSlope * (std::abs(run_x) + std::abs(run_y));
      if (!(std::abs(rise) <= max_rise)) continue;
      xx += run_x * run_x;
      yy += run_y * run_y;
      xz += run_x * rise;
      yz += run_y * rise;
    }
  }
  const Eigen::Vector3f normal =
      Eigen::Vector3f(xx > 0 ? xz / xx : 0, yy > 0 ? yz / yy : 0, -1).normalized();
  const Eigen::Vector3f to_light = Eigen::Vector3f(-0.45F, -0.55F, -0.7F).normalized();
  return std::max(0.0F, normal.dot(to_light)) / -to_light.z();
}

void Shade(Canvas& canvas) {
  cv::parallel_for_(cv::Range(0, canvas.depth.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < canvas.depth.cols; ++x) {
        if (canvas.depth.at<float>(y, x) == kNoSurface) continue;
        const float ambient = canvas.ambient.at<float>(y, x);
        const float light = ambient + (1 - ambient) * Light(canvas.depth, x, y);
        cv::Vec3b& colour = canvas.colour.at<cv::Vec3b>(y, x);
        for (int c = 0; c < 3; ++c) {
          colour[c] = cv::saturate_cast<uchar>(light * static_cast<float>(colour[c]));
        }
      }
    }
  });
}

void CheckLayers(std::span<const CloudLayer> layers, const CloudView& view) {
  for (const CloudLayer& layer : layers) {
    CheckCloud(*layer.cloud, "cloud to render");
    if (!layer.values.empty() && layer.values.size() != layer.cloud->size()) {
      throw Error(ErrorParts{"a value for some points only", "cloud to render",
                             std::to_string(layer.cloud->size()),
                             std::to_string(layer.values.size())});
    }
    if (!layer.values.empty() && !(layer.max_value > 0)) {
      throw Error(ErrorParts{"the end of the colour scale is not positive", "cloud to render",
                             "more than 0", std::to_string(layer.max_value)});
    }
  }
  if (view.size.width < 1 || view.size.height < 1 || !(view.pixel_su > 0)) {
    throw Error("a view without size: " + view.name);
  }
}

}  // namespace

cv::Vec3b ErrorColour(double share) {
  struct Stop {
    double blue, green, red;
  };
  static constexpr std::array<Stop, 5> kStops = {
      {{240, 236, 230}, {160, 205, 150}, {70, 214, 245}, {45, 125, 240}, {30, 15, 160}}};
  const double position = std::clamp(std::isfinite(share) ? share : 1, 0.0, 1.0) * 4;
  const auto below = static_cast<std::size_t>(std::min(3.0, std::floor(position)));
  const double part = position - static_cast<double>(below);
  const Stop& a = kStops[below];
  const Stop& b = kStops[below + 1];
  return {cv::saturate_cast<uchar>(a.blue + part * (b.blue - a.blue)),
          cv::saturate_cast<uchar>(a.green + part * (b.green - a.green)),
          cv::saturate_cast<uchar>(a.red + part * (b.red - a.red))};
}

std::vector<float> SplatRadii(const PointCloud& cloud) {
  if (!cloud.radii.empty()) return cloud.radii;
  std::vector<float> radii(cloud.size(), 0.0F);
  const int count = static_cast<int>(std::min(kSplatNeighbours, cloud.size()));
  const std::vector<Eigen::Vector3d> points = CloudPoints(cloud);
  const std::vector<std::uint32_t> neighbours = CloudSearch(points).Nearest(points, count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t farthest = neighbours[(i + 1) * static_cast<std::size_t>(count) - 1];
    radii[i] = kSplatShare * (cloud.points[farthest] - cloud.points[i]).norm();
  }
  const float largest = kMaxSplatInMedians * UpperMedian(radii);
  for (float& radius : radii) radius = std::min(radius, largest);
  return radii;
}

cv::Mat RenderLayers(std::span<const CloudLayer> layers,
                     std::span<const std::vector<float>> splat_radii, const CloudView& view) {
  CheckLayers(layers, view);
  const cv::Size samples = view.size * kSamplesPerPixel;
  Canvas canvas{cv::Mat(samples, CV_32F, cv::Scalar(kNoSurface)), cv::Mat(samples, CV_8UC3),
                cv::Mat(samples, CV_32F, cv::Scalar(1))};
  canvas.colour.setTo(kBackground);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    DrawLayer(canvas, layers[i], splat_radii[i], view);
  }
  Shade(canvas);
  cv::Mat picture;
  cv::resize(canvas.colour, picture, view.size, 0, 0, cv::INTER_AREA);
  return picture;
}

cv::Mat RenderClouds(std::span<const CloudLayer> layers, const CloudView& view) {
  CheckLayers(layers, view);
  std::vector<std::vector<float>> radii;
  for (const CloudLayer& layer : layers) radii.push_back(SplatRadii(*layer.cloud));
  return RenderLayers(layers, radii, view);
}

}  // namespace mono3d::tools
