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

// What of its confidence a pixel keeps for the angle under which it sees the surface: `along` is
// its unit normal times the ray, turned towards the camera. Beyond kMaxSlantDeg it shows the edge
// of a surface, or the ramp that smoothing lays across a depth step: its depth moves with every
// fraction of a pixel, by the tangent of the angle, and its information falls with the square of
// that, which is nearly that of the cosine. 1 without a normal.
float SlantShare(double along, double ray_square) {
  static const double least_cosine = std::cos(kMaxSlantDeg * std::numbers::pi / 180);
  const double share = along * along / (least_cosine * least_cosine * ray_square);
  return along <= 0 || share >= 1 ? 1.0F : static_cast<float>(share);
}

// Beyond the border that the estimator does not trust.
bool IsInside(const DepthMap& map, int x, int y) {
  const int border = map.uncertain_border_px;
  return x >= border && y >= border && x < map.camera.width - border &&
         y < map.camera.height - border;
}

void PackColours(const DepthMap& map, std::vector<std::uint32_t>& colours) {
  if (map.bgr.empty()) {
    colours.assign(static_cast<std::size_t>(map.camera.width) * map.camera.height, kGrey);
    return;
  }
  colours.resize(map.bgr.total());
  std::uint32_t* to = colours.data();
  for (int y = 0; y < map.bgr.rows; ++y) {
    const auto* from = map.bgr.ptr<cv::Vec3b>(y);
    for (int x = 0; x < map.bgr.cols; ++x) {
      const cv::Vec3b& bgr = from[x];
      *to++ = bgr[2] | static_cast<std::uint32_t>(bgr[1] << 8) |
              static_cast<std::uint32_t>(bgr[0] << 16);
    }
  }
}

}  // namespace

void Pack(const DepthMap& map, bool with_confidence, PackedDepthMap& packed,
          std::span<const std::uint32_t> colours) {
  if (colours.empty()) {
    PackColours(map, packed.colour);
  } else {
    packed.colour.assign(colours.begin(), colours.end());
  }
  const auto num_pixels = static_cast<std::size_t>(map.camera.width) * map.camera.height;
  packed.depth.resize(num_pixels);
  packed.normal_confidence.resize(num_pixels);
  packed.num_candidates = 0;
  packed.blocks.clear();
  packed.blocks_to_fit.clear();
  const auto add_block = [](std::size_t pixel, std::vector<std::uint32_t>& blocks) {
    const auto block = static_cast<std::uint32_t>(pixel / kSurfelsPerBlock);
    if (blocks.empty() || blocks.back() != block) blocks.push_back(block);
  };
  std::vector<double> ray_x;  // the camera has no distortion
  for (int x = 0; x < map.camera.width; ++x) ray_x.push_back(map.camera.Unproject({x, 0}).x());
  std::size_t i = 0;
  for (int y = 0; y < map.camera.height; ++y) {
    const double ray_y = map.camera.Unproject({0, y}).y();
    const auto* depth = map.depth.ptr<float>(y);
    const auto* confidences =
        map.confidence.empty() || !with_confidence ? nullptr : map.confidence.ptr<float>(y);
    const auto* normals = map.normal.empty() ? nullptr : map.normal.ptr<cv::Vec3f>(y);
    for (int x = 0; x < map.camera.width; ++x, ++i) {
      const float z = depth[x];
      float confidence = confidences == nullptr ? 1.0F : std::min(confidences[x], 1.0F);
      // Written so that NaN fails.
      const bool is_candidate = std::isfinite(z) && z > 0 && confidence > 0 && IsInside(map, x, y);
      packed.depth[i] = is_candidate ? z : 0.0F;
      packed.normal_confidence[i] = {0, 0, 0, 0};
      if (!is_candidate) continue;
      ++packed.num_candidates;
      add_block(i, packed.blocks);
      cv::Vec3f n(0, 0, 0);
      if (normals != nullptr) n = normals[x];
      if (!std::isfinite(n[0] + n[1] + n[2])) n = cv::Vec3f(0, 0, 0);
      const double rx = ray_x[static_cast<std::size_t>(x)];
      const double along = -(rx * n[0] + ray_y * n[1] + n[2]);
      if (with_confidence) confidence *= SlantShare(along, rx * rx + ray_y * ray_y + 1);
      if (along > 0) {
        n = cv::normalize(n);
        packed.normal_confidence[i] = {n[0], n[1], n[2], confidence};
      } else {
        add_block(i, packed.blocks_to_fit);
        packed.normal_confidence[i][3] = confidence;
      }
    }
  }
}

PackedDepthMap Pack(const DepthMap& map, bool with_confidence) {
  PackedDepthMap packed;
  Pack(map, with_confidence, packed);
  return packed;
}

DepthMapBuffers::DepthMapBuffers(const std::shared_ptr<Device>& device, int width_px,
                                 int height_px) {
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  const std::size_t cells = pixels * kIndexCellsPerPixel * kIndexCellsPerPixel;
  const std::size_t words = (pixels + 31) / 32;
  depth = Buffer(device, pixels * 4, "fusion/depth");
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

void DepthMapBuffers::Upload(const std::shared_ptr<Device>& device, const PackedDepthMap& map) {
  depth.Upload(AsSpan(map.depth));
  candidate.Upload(AsSpan(map.normal_confidence));
  colour.Upload(AsSpan(map.colour));
  blocks.Set(device, map.blocks);
  blocks_to_fit.Set(device, map.blocks_to_fit);
}

}  // namespace mono3d
