// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/past_views.h"

#include <algorithm>
#include <utility>

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
  return view;
}

}  // namespace

void PastViews::Push(const std::shared_ptr<Device>& device, const DepthMap& map,
                     DepthMapBuffers& buffers) {
  if (max_views_ == 0) return;
  const std::size_t depth_bytes = buffers.depth.size_bytes();
  const std::size_t candidate_bytes = buffers.candidate.size_bytes();
  PastView view;
  view.view = WithoutImages(map);
  view.buffers.depth = std::move(buffers.depth);
  view.buffers.candidate = std::move(buffers.candidate);
  views_.push_back(std::move(view));

  const std::size_t room = std::max<std::size_t>(1, kMaxBytes / (depth_bytes + candidate_bytes));
  PastView oldest;
  while (views_.size() > std::min(max_views_, room)) {
    oldest = std::move(views_.front());
    views_.pop_front();
  }
  const bool fits = oldest.buffers.depth.size_bytes() == depth_bytes;
  buffers.depth =
      fits ? std::move(oldest.buffers.depth) : Buffer(device, depth_bytes, "fusion/depth");
  buffers.candidate = fits ? std::move(oldest.buffers.candidate)
                           : Buffer(device, candidate_bytes, "fusion/candidate");
}

}  // namespace mono3d
