// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "mono3d/core/error.h"
#include "synthetic/noise.h"
#include "synthetic/shading.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

// The camera's rays in the world.
struct View {
  const CameraModel& camera;
  Vector3f origin;
  Eigen::Matrix3f R_world_cam;

  Ray At(double x, double y) const {
    const Vector3f direction_cam = camera.Unproject({x, y}).cast<float>();
    return {origin, R_world_cam * direction_cam, 0};  // z = 1: the hit's distance is the depth
  }
};

// Mean over a lattice of samples, turned against the pixel so that no two share a row or a column,
// and centred on it, so that edges are not shifted.
Vector3f PixelRadiance(const Scene& scene, const View& view, cv::Point pixel,
                       int samples_per_side) {
  const auto pixel_width = static_cast<float>(1 / view.camera.fx);
  Vector3f sum = Vector3f::Zero();
  for (int j = 0; j < samples_per_side; ++j) {
    for (int i = 0; i < samples_per_side; ++i) {
      const double n = samples_per_side;
      const double a = (i + 0.5) / n - 0.5;
      const double b = (j + 0.5) / n - 0.5;
      sum += Radiance(scene, view.At(pixel.x + a + b / n, pixel.y + b - a / n), pixel_width);
    }
  }
  return sum / static_cast<float>(samples_per_side * samples_per_side);
}

// Standard normal numbers from hashed bits (Box and Muller 1958).
float NormalNoise(cv::Point pixel, int channel, int seed) {
  const auto hash_seed = static_cast<std::uint32_t>(seed);
  const float u = std::max(HashUnit(pixel.x, pixel.y, 2 * channel, hash_seed), 1e-7F);
  const float v = HashUnit(pixel.x, pixel.y, 2 * channel + 1, hash_seed);
  return std::sqrt(-2 * std::log(u)) * std::cos(6.2831853F * v);
}

cv::Vec3b Develop(const Vector3f& radiance, cv::Point pixel, const RenderOptions& options) {
  const auto exposure = static_cast<float>(options.exposure);
  const auto noise = static_cast<float>(options.noise_grey_levels);
  cv::Vec3b bgr;
  for (int channel = 0; channel < 3; ++channel) {
    const float linear = std::clamp(exposure * radiance[2 - channel], 0.0F, 1.0F);
    float level = 255 * std::pow(linear, 1 / 2.2F);
    if (noise > 0) level += noise * NormalNoise(pixel, channel, options.noise_seed);
    bgr[channel] = static_cast<std::uint8_t>(std::clamp(level + 0.5F, 0.0F, 255.0F));
  }
  return bgr;
}

}  // namespace

void RenderOptions::Visit(OptionVisitor& visit) {
  visit("samples_per_side", samples_per_side, "samples a pixel, squared");
  visit("exposure", exposure, "brightness factor");
  visit("noise_grey_levels", noise_grey_levels, "standard deviation of the image noise");
  visit("noise_seed", noise_seed, "seed of the image noise");
  visit("with_depth", with_depth, "render the depth image as well");
}

void RenderOptions::Validate() const {
  RequireOption(samples_per_side >= 1 && samples_per_side <= 16, "samples_per_side", "1 to 16",
                samples_per_side);
  RequireOption(std::isfinite(exposure) && exposure > 0, "exposure", "above 0", exposure);
  RequireOption(std::isfinite(noise_grey_levels) && noise_grey_levels >= 0, "noise_grey_levels",
                "at least 0", noise_grey_levels);
}

Rendering Render(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam,
                 const RenderOptions& options) {
  Validate(camera, "synthetic camera");
  options.Validate();
  if (camera.HasDistortion()) throw Error("the synthetic camera must be without distortion");
  const View view{camera, T_world_cam.translation().cast<float>(),
                  T_world_cam.rotation().toRotationMatrix().cast<float>()};
  Rendering out;
  out.bgr.create(camera.height, camera.width, CV_8UC3);
  if (options.with_depth) out.depth = cv::Mat::zeros(camera.height, camera.width, CV_32FC1);
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const cv::Point pixel(x, y);
        const Vector3f radiance = PixelRadiance(scene, view, pixel, options.samples_per_side);
        out.bgr.at<cv::Vec3b>(pixel) = Develop(radiance, pixel, options);
        if (!options.with_depth) continue;
        const std::optional<Hit> hit = scene.Intersect(view.At(x, y));
        if (hit) out.depth.at<float>(pixel) = hit->distance;
      }
    }
  });
  return out;
}

}  // namespace mono3d::synthetic
