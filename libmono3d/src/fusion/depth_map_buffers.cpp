// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/depth_map_buffers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "fusion/exposure.h"
#include "fusion/surfel.h"
#include "fusion/view.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kGrey = 0x808080;

template <typename T>
std::span<const T> AsSpan(const std::vector<T>& values) {
  return values;
}

// What of its confidence a pixel keeps for the angle under which it sees the surface. Beyond
// kMaxSlantDeg it shows the edge of a surface, or the ramp that smoothing lays across a depth step:
// its depth moves with every fraction of a pixel, by the tangent of the angle, and its information
// falls with the square of that, which is nearly that of the cosine. 1 without a normal.
float SlantShare(const CameraModel& camera, int x, int y, const cv::Vec3f& n) {
  static const double least_cosine = std::cos(kMaxSlantDeg * std::numbers::pi / 180);
  const Eigen::Vector3d ray = camera.Unproject({x, y});
  const double along = -(ray.x() * n[0] + ray.y() * n[1] + ray.z() * n[2]);
  const double share = along * along / (least_cosine * least_cosine * ray.squaredNorm());
  return along <= 0 || share >= 1 ? 1.0F : static_cast<float>(share);
}

// Beyond the border that the estimator does not trust.
bool IsInside(const DepthMap& map, int x, int y) {
  const int border = map.uncertain_border_px;
  return x >= border && y >= border && x < map.camera.width - border &&
         y < map.camera.height - border;
}

}  // namespace

PackedDepthMap Pack(const DepthMap& map, bool with_confidence) {
  PackedDepthMap packed;
  const auto num_pixels = static_cast<std::size_t>(map.camera.width) * map.camera.height;
  packed.depth.resize(num_pixels);
  packed.normal_confidence.resize(num_pixels);
  packed.colour.resize(num_pixels, kGrey);
  std::size_t i = 0;
  for (int y = 0; y < map.camera.height; ++y) {
    const auto* depth = map.depth.ptr<float>(y);
    const auto* confidences =
        map.confidence.empty() || !with_confidence ? nullptr : map.confidence.ptr<float>(y);
    const auto* normals = map.normal.empty() ? nullptr : map.normal.ptr<cv::Vec3f>(y);
    const auto* colours = map.bgr.empty() ? nullptr : map.bgr.ptr<cv::Vec3b>(y);
    for (int x = 0; x < map.camera.width; ++x, ++i) {
      const float z = depth[x];
      float confidence = confidences == nullptr ? 1.0F : confidences[x];
      // Written so that NaN fails.
      const bool is_candidate = std::isfinite(z) && z > 0 && confidence > 0 && IsInside(map, x, y);
      confidence = is_candidate ? std::min(confidence, 1.0F) : 0.0F;
      packed.depth[i] = is_candidate ? z : 0.0F;
      packed.num_candidates += is_candidate ? 1 : 0;
      cv::Vec3f n(0, 0, 0);
      if (normals != nullptr) n = normals[x];
      if (!std::isfinite(n[0] + n[1] + n[2])) n = cv::Vec3f(0, 0, 0);
      if (with_confidence) confidence *= SlantShare(map.camera, x, y, n);
      packed.normal_confidence[i] = {n[0], n[1], n[2], confidence};
      if (colours == nullptr) continue;
      const cv::Vec3b& bgr = colours[x];
      packed.colour[i] = bgr[2] | static_cast<std::uint32_t>(bgr[1] << 8) |
                         static_cast<std::uint32_t>(bgr[0] << 16);
    }
  }
  return packed;
}

DepthMapBuffers::DepthMapBuffers(const std::shared_ptr<Device>& device, int width_px,
                                 int height_px) {
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  const std::size_t cells = pixels * kIndexCellsPerPixel * kIndexCellsPerPixel;
  const std::size_t words = (pixels + 31) / 32;
  depth = Buffer(device, pixels * 4, "fusion/depth");
  normal_confidence = Buffer(device, pixels * 16, "fusion/normal_confidence");
  colour = Buffer(device, pixels * 4, "fusion/colour");
  candidate = Buffer(device, pixels * 16, "fusion/candidate");
  index_map = Buffer(device, cells * 8, "fusion/index_map");
  selected = Buffer(device, words * 4, "fusion/selected");
  new_pixels = Buffer(device, pixels * 4, "fusion/new_pixels");
  exposure_cells = Buffer(device,
                          NumExposureCells(static_cast<std::uint32_t>(width_px),
                                           static_cast<std::uint32_t>(height_px)) *
                              sizeof(ExposureCell),
                          "fusion/exposure_cells");
  num_removed = Buffer(device, 4, "fusion/num_removed");
}

void DepthMapBuffers::Upload(const PackedDepthMap& map) {
  depth.Upload(AsSpan(map.depth));
  normal_confidence.Upload(AsSpan(map.normal_confidence));
  colour.Upload(AsSpan(map.colour));
}

}  // namespace mono3d
