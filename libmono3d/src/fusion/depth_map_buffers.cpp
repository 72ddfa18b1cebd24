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
constexpr std::uint32_t kCoarseMatchOfPixel = 1U << 24;  // surfel.glsl

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

void PackColours(const DepthMap& map, std::span<std::uint32_t> colours) {
  if (map.bgr.empty()) {
    std::ranges::fill(colours, kGrey);
    return;
  }
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

// Lists the block of a pixel that comes after those listed.
void AddBlock(std::size_t pixel, std::vector<std::uint32_t>& blocks) {
  const auto block = static_cast<std::uint32_t>(pixel / kSurfelsPerBlock);
  if (blocks.empty() || blocks.back() != block) blocks.push_back(block);
}

// Packs pixels in their order.
class PixelPacker {
 public:
  PixelPacker(const DepthMap& map, bool with_confidence, const PackedPixels& to,
              PackedBlocks& blocks)
      : map_(map), with_confidence_(with_confidence), to_(to), blocks_(blocks) {
    for (int x = 0; x < map.camera.width; ++x) ray_x_.push_back(map.camera.Unproject({x, 0}).x());
  }

  void BeginRow(int y) {
    y_ = y;
    first_ = static_cast<std::size_t>(y) * static_cast<std::size_t>(map_.camera.width);
    ray_y_ = map_.camera.Unproject({0, y}).y();
    depth_ = map_.depth.ptr<float>(y);
    confidences_ =
        map_.confidence.empty() || !with_confidence_ ? nullptr : map_.confidence.ptr<float>(y);
    normals_ = map_.normal.empty() ? nullptr : map_.normal.ptr<cv::Vec3f>(y);
  }

  // False, with nothing written, where the pixel is no candidate.
  bool Pack(int x) {
    const float z = depth_[x];
    float confidence = confidences_ == nullptr ? 1.0F : std::min(confidences_[x], 1.0F);
    // Written so that NaN fails.
    if (!(std::isfinite(z) && z > 0 && confidence > 0 && IsInside(map_, x, y_))) return false;
    const std::size_t i = first_ + static_cast<std::size_t>(x);
    to_.depth[i] = z;
    ++blocks_.num_candidates;
    AddBlock(i, blocks_.with_candidates);
    cv::Vec3f n(0, 0, 0);
    if (normals_ != nullptr) n = normals_[x];
    if (!std::isfinite(n[0] + n[1] + n[2])) n = cv::Vec3f(0, 0, 0);
    const double rx = ray_x_[static_cast<std::size_t>(x)];
    const double along = -(rx * n[0] + ray_y_ * n[1] + n[2]);
    if (with_confidence_) confidence *= SlantShare(along, rx * rx + ray_y_ * ray_y_ + 1);
    if (along > 0) {
      n = cv::normalize(n);
      to_.normal_confidence[i] = {n[0], n[1], n[2], confidence};
    } else {
      AddBlock(i, blocks_.to_fit);
      to_.normal_confidence[i] = {0, 0, 0, confidence};
    }
    return true;
  }

 private:
  const DepthMap& map_;
  bool with_confidence_;
  const PackedPixels& to_;
  PackedBlocks& blocks_;
  std::vector<double> ray_x_;  // the camera has no distortion
  int y_ = 0;
  std::size_t first_ = 0;  // of the row
  double ray_y_ = 0;
  const float* depth_ = nullptr;
  const float* confidences_ = nullptr;
  const cv::Vec3f* normals_ = nullptr;
};

}  // namespace

PackedBlocks Pack(const DepthMap& map, bool with_confidence, const PackedPixels& to) {
  PackColours(map, to.colour);
  PackedBlocks blocks;
  PixelPacker packer(map, with_confidence, to, blocks);
  std::size_t i = 0;
  for (int y = 0; y < map.camera.height; ++y) {
    packer.BeginRow(y);
    for (int x = 0; x < map.camera.width; ++x, ++i) {
      if (packer.Pack(x)) continue;
      to.depth[i] = 0;
      to.normal_confidence[i] = {0, 0, 0, 0};
    }
  }
  return blocks;
}

PackedBlocks PackInferred(const DepthMap& map, bool with_confidence,
                          std::span<const std::uint32_t> colours, const PackedPixels& to,
                          std::vector<std::uint32_t>& pixels) {
  for (const std::uint32_t pixel : pixels) {
    to.depth[pixel] = 0;
    to.normal_confidence[pixel] = {0, 0, 0, 0};
  }
  pixels.clear();
  PackedBlocks blocks;
  PixelPacker packer(map, with_confidence, to, blocks);
  for (int y = 0; y < map.inferred.rows; ++y) {
    packer.BeginRow(y);
    const auto* is_inferred = map.inferred.ptr<std::uint8_t>(y);
    for (int x = 0; x < map.inferred.cols; ++x) {
      if (is_inferred[x] == 0 || !packer.Pack(x)) continue;
      const auto pixel = static_cast<std::uint32_t>(y * map.camera.width + x);
      to.colour[pixel] = colours.empty() ? kGrey : colours[pixel];
      if (is_inferred[x] == kCoarselyMatched) to.colour[pixel] |= kCoarseMatchOfPixel;
      pixels.push_back(pixel);
    }
  }
  return blocks;
}

PackedDepthMap Pack(const DepthMap& map, bool with_confidence) {
  const auto num_pixels = static_cast<std::size_t>(map.camera.width) * map.camera.height;
  PackedDepthMap packed{std::vector<float>(num_pixels),
                        std::vector<std::array<float, 4>>(num_pixels),
                        std::vector<std::uint32_t>(num_pixels),
                        {}};
  packed.blocks =
      Pack(map, with_confidence, {packed.depth, packed.normal_confidence, packed.colour});
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

std::int64_t DepthMapBuffers::Write(const std::shared_ptr<Device>& device, const PackPixels& pack) {
  const PackedBlocks packed =
      pack({depth.BeginWrite(copies.depth), candidate.BeginWrite(copies.normal_confidence),
            colour.BeginWrite(copies.colour)});
  depth.EndWrite(copies.depth);
  candidate.EndWrite(copies.normal_confidence);
  colour.EndWrite(copies.colour);
  blocks.Set(device, packed.with_candidates);
  blocks_to_fit.Set(device, packed.to_fit);
  return packed.num_candidates;
}

}  // namespace mono3d
