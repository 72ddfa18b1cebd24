// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/past_views.h"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fusion/state_archive.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Beyond the memory of some 37 maps of 768x448 the views are fewer.
constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

DepthMap WithoutImages(const DepthMap& map) {
  DepthMap view = map;
  view.depth.release();
  view.normal.release();
  view.confidence.release();
  view.bgr.release();
  view.inferred.release();
  return view;
}

// A buffer with a value for each pixel.
template <typename Archive, typename Pixel>
void ExchangeBuffer(Archive& archive, const std::shared_ptr<Device>& device, Buffer& buffer,
                    const CameraModel& camera, std::vector<Pixel>& pixels, const char* name) {
  if constexpr (!kIsReader<Archive>) pixels = buffer.Download<Pixel>();
  archive.Array(pixels);
  const auto num_pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  RequireSound(archive, pixels.size() == num_pixels);
  if constexpr (kIsReader<Archive>) {
    buffer = Buffer(device, num_pixels * sizeof(Pixel), name);
    buffer.Upload(std::span<const Pixel>(pixels));
  }
}

}  // namespace

void PastView::LookAt(const std::shared_ptr<Device>& device, const ViewParams& params,
                      const AnchorMap& of_model, std::uint32_t number,
                      std::span<const std::uint32_t> added, std::span<const BlockSphere> spheres) {
  const Similarity& S_world_view = of_model.S_world_kf()[anchor];
  anchors.Set(device, S_world_view, of_model.S_world_surfels());
  std::vector<std::uint32_t> in_view =
      SpheresInView(spheres, params, S_world_view.Inverse() * of_model.S_world_surfels()[number]);
  for (std::uint32_t& block : in_view) block = added[block];
  new_blocks.Set(device, in_view);
}

void PastViews::Push(const std::shared_ptr<Device>& device, const DepthMap& map,
                     std::uint32_t anchor, DepthMapBuffers& buffers) {
  if (max_views_ == 0) return;
  const std::size_t depth_bytes = buffers.depth.size_bytes();
  const std::size_t candidate_bytes = buffers.candidate.size_bytes();
  const std::size_t room = std::max<std::size_t>(1, kMaxBytes / (depth_bytes + candidate_bytes));
  PastView oldest;
  while (views_.size() >= std::min(max_views_, room)) {
    oldest = std::move(views_.front());
    views_.pop_front();
  }
  Buffer depth = std::move(oldest.buffers.depth);
  Buffer candidate = std::move(oldest.buffers.candidate);
  if (depth.size_bytes() != depth_bytes) {
    try {
      depth = Buffer(device, depth_bytes, "fusion/depth");
      candidate = Buffer(device, candidate_bytes, "fusion/candidate");
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kOutOfMemory) throw;
      Log(LogLevel::kDebug, std::string("one past view less: ") + error.what());
      return;
    }
  }
  PastView view;
  view.map = WithoutImages(map);
  view.anchor = anchor;
  view.buffers.depth = std::exchange(buffers.depth, std::move(depth));
  view.buffers.candidate = std::exchange(buffers.candidate, std::move(candidate));
  views_.push_back(std::move(view));
}

template <typename Archive>
void PastViews::Exchange(Archive& archive, PastView& view, const std::shared_ptr<Device>& device) {
  ExchangeFrameOf(archive, view.map);
  archive.Number(view.anchor);
  std::vector<float> depth;
  std::vector<std::array<float, 4>> candidate;
  ExchangeBuffer(archive, device, view.buffers.depth, view.map.camera, depth, "fusion/depth");
  ExchangeBuffer(archive, device, view.buffers.candidate, view.map.camera, candidate,
                 "fusion/candidate");
}

template void PastViews::Exchange(ByteWriter& archive, PastView& view,
                                  const std::shared_ptr<Device>& device);
template void PastViews::Exchange(ByteReader& archive, PastView& view,
                                  const std::shared_ptr<Device>& device);

}  // namespace mono3d
