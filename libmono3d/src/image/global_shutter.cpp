// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/global_shutter.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "image/inverse_depth_surface.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

bool IsDepth(float depth_su) { return std::isfinite(depth_su) && depth_su > 0; }

// Where the image would show a point of the z-depth, had all lines been read with the middle one.
Eigen::Vector2d MovedPixel(const ShutterMotion& motion, const CameraModel& camera,
                           const Eigen::Vector2d& pixel, double depth_su) {
  // The point follows from the pixel and the pixel from the point. What is left falls with each
  // round by how much the motion differs from a pixel to the next: some percent.
  constexpr int kRounds = 3;
  Eigen::Vector2d moved = pixel;
  for (int i = 0; i < kRounds; ++i) {
    moved = motion.AtMiddleLine(camera, pixel, depth_su * camera.Unproject(moved));
  }
  return moved;
}

std::vector<Eigen::Vector2f> MovedPixels(const ShutterMotion& motion, const Keyframe& keyframe) {
  std::vector<Eigen::Vector2f> pixels = keyframe.sparse_pixels;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const float depth_su = keyframe.sparse_depths_su[i];
    if (!IsDepth(depth_su)) continue;
    pixels[i] =
        MovedPixel(motion, keyframe.frame.camera, pixels[i].cast<double>(), depth_su).cast<float>();
  }
  return pixels;
}

// From the points of a keyframe whose pixels have been moved.
InverseDepthSurface SurfaceOf(const Keyframe& keyframe) {
  std::vector<InverseDepthSample> samples;
  std::vector<double> inverse_depths;
  for (std::size_t i = 0; i < keyframe.sparse_depths_su.size(); ++i) {
    const float depth_su = keyframe.sparse_depths_su[i];
    if (!IsDepth(depth_su)) continue;
    inverse_depths.push_back(1.0 / depth_su);
    if (keyframe.sparse_pixels.empty()) continue;
    samples.push_back({keyframe.sparse_pixels[i].cast<double>(), inverse_depths.back()});
  }
  if (samples.empty()) return InverseDepthSurface(UpperMedianOrZero(inverse_depths));
  return {keyframe.frame.camera.width, keyframe.frame.camera.height, samples};
}

// The way of the scene between the middle line and that of each pixel, at the nodes of a grid over
// the image.
class Displacements {
 public:
  Displacements(const ShutterMotion& motion, const CameraModel& camera,
                const InverseDepthSurface& surface)
      : nodes_((camera.height - 1) / kStep_px + 2, (camera.width - 1) / kStep_px + 2,
               cv::Vec2f(0, 0)) {
    for (int y = 0; y < nodes_.rows; ++y) {
      for (int x = 0; x < nodes_.cols; ++x) {
        const Eigen::Vector2d pixel(x * kStep_px, y * kStep_px);
        ShutterMotion in_depths = motion;  // lengths in depths of the pixel
        in_depths.Rescale(surface.At(pixel));
        const Eigen::Vector3d p_line = in_depths.AtItsLine(camera.Unproject(pixel));
        if (p_line.z() <= 0) continue;  // no camera turns that fast
        const Eigen::Vector2d way = camera.Project(p_line) - pixel;
        nodes_(y, x) = {static_cast<float>(way.x()), static_cast<float>(way.y())};
      }
    }
  }

  // For cv::remap: where each pixel comes from.
  cv::Mat Map(const cv::Size& size) const {
    cv::Mat_<cv::Vec2f> map(size);
    std::vector<cv::Vec2f> row(static_cast<std::size_t>(nodes_.cols));
    for (int y = 0; y < size.height; ++y) {
      const int above = y / kStep_px;
      const float below_weight = static_cast<float>(y % kStep_px) / kStep_px;
      for (int x = 0; x < nodes_.cols; ++x) {
        row[static_cast<std::size_t>(x)] =
            nodes_(above, x) * (1 - below_weight) + nodes_(above + 1, x) * below_weight;
      }
      cv::Vec2f* const to = map[y];
      for (int x = 0; x < size.width; ++x) {
        const auto left = static_cast<std::size_t>(x / kStep_px);
        const float weight = static_cast<float>(x % kStep_px) / kStep_px;
        const cv::Vec2f way = row[left] * (1 - weight) + row[left + 1] * weight;
        to[x] = {static_cast<float>(x) + way[0], static_cast<float>(y) + way[1]};
      }
    }
    return map;
  }

 private:
  // Across it the way is as good as linear: it bends over the size of the image.
  static constexpr int kStep_px = 16;
  cv::Mat_<cv::Vec2f> nodes_;
};

}  // namespace

Keyframe WithGlobalShutter(const Keyframe& keyframe) {
  const std::size_t num_depths = keyframe.sparse_depths_su.size();
  const std::size_t num_pixels = keyframe.sparse_pixels.size();
  if (num_pixels > 0 && num_pixels != num_depths) {
    throw Error(ErrorParts{.what = "wrong number of sparse pixels",
                           .where = keyframe.frame.name,
                           .expected = "one for each of " + std::to_string(num_depths) + " depths",
                           .found = std::to_string(num_pixels)});
  }
  Keyframe result = keyframe;
  result.frame.sensor = {};
  const Frame& frame = keyframe.frame;
  if (frame.sensor.width == 0) return result;
  const ShutterMotion motion(frame.sensor, keyframe.velocity);
  if (motion.IsStill()) return result;
  result.sparse_pixels = MovedPixels(motion, keyframe);
  const Displacements displacements(motion, frame.camera, SurfaceOf(result));
  result.frame.bgr = cv::Mat();  // shared with the keyframe that is there already
  cv::remap(frame.bgr, result.frame.bgr, displacements.Map(frame.bgr.size()), cv::noArray(),
            cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return result;
}

}  // namespace mono3d
