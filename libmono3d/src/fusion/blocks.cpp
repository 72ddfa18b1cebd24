// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/blocks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>

#include "fusion/bound_blocks.params.h"
#include "fusion/bound_blocks.spirv.h"
#include "fusion/cull_blocks.spirv.h"
#include "fusion/grid.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kNoBlock = 0xFFFFFFFFU;  // its surfels are beyond any model

ViewParams Enlarged(const ViewParams& view, std::uint32_t margin_px, std::uint32_t num_surfels) {
  ViewParams larger = view;
  larger.width_px += 2 * margin_px;
  larger.height_px += 2 * margin_px;
  larger.cx += static_cast<float>(margin_px);
  larger.cy += static_cast<float>(margin_px);
  larger.num_surfels = num_surfels;
  return larger;
}

// Signed distance of a point from a plane through the camera, on whose inner side both coordinates
// weigh positive; as in shaders/fusion/cull_blocks.comp.
double InsideOf(double across, double z, double across_weight, double z_weight) {
  return (across_weight * across + z_weight * z) / std::hypot(across_weight, z_weight);
}

// Whether the device may find a sphere in view: what it finds in single precision, and a little
// more.
bool MaySee(const ViewParams& view, const AnchorTransform& to_view, const Surfels::Float4& sphere) {
  if (sphere[3] < 0) return false;
  // Some of the last bits of the largest number on the way.
  constexpr double kRounding = 1e-5;
  const auto& [qx, qy, qz, qw] = to_view.rotation;
  const Eigen::Quaterniond rotation(qw, qx, qy, qz);
  const double scale = to_view.translation_scale[3];
  const Eigen::Vector3d centre = scale * Eigen::Vector3d(sphere[0], sphere[1], sphere[2]);
  const Eigen::Vector3d translation(to_view.translation_scale[0], to_view.translation_scale[1],
                                    to_view.translation_scale[2]);
  const Eigen::Vector3d p = rotation * centre + translation;
  const double radius = scale * sphere[3];
  const double reach = radius + kRounding * (centre.norm() + translation.norm() + radius);
  const double width = view.width_px, height = view.height_px;
  return p.z() >= -reach && InsideOf(p.x(), p.z(), view.fx, view.cx + 0.5) >= -reach &&
         InsideOf(p.x(), p.z(), -view.fx, width - 0.5 - view.cx) >= -reach &&
         InsideOf(p.y(), p.z(), view.fy, view.cy + 0.5) >= -reach &&
         InsideOf(p.y(), p.z(), -view.fy, height - 0.5 - view.cy) >= -reach;
}

bool MaySee(const ViewParams& view, const AnchorTable& anchors,
            const SurfelStorage::Outside& outside) {
  const AnchorTransform& to_view = anchors.transforms()[outside.anchor];
  return MaySee(view, to_view, outside.whole) &&
         std::ranges::any_of(outside.blocks, [&](const Surfels::Float4& sphere) {
           return MaySee(view, to_view, sphere);
         });
}

}  // namespace

void BlockList::Set(const std::shared_ptr<Device>& device, std::span<const std::uint32_t> numbers) {
  numbers_.assign(numbers.begin(), numbers.end());
  size_ = static_cast<std::uint32_t>(numbers.size());
  grid_ = GroupGrid(size_);
  std::vector<std::uint32_t> padded(std::max<std::size_t>(std::size_t{grid_[0]} * grid_[1], 1),
                                    kNoBlock);
  std::copy(numbers.begin(), numbers.end(), padded.begin());
  const std::size_t bytes = padded.size() * sizeof(std::uint32_t);
  if (buffer_.size_bytes() < bytes) {
    buffer_ = Buffer(device, bytes + bytes / 2, "fusion/block_list");
  }
  buffer_.Upload(std::span<const std::uint32_t>(padded));
}

void BlockList::SetRange(const std::shared_ptr<Device>& device, std::uint32_t first,
                         std::uint32_t end) {
  std::vector<std::uint32_t> numbers;
  if (first < end) {
    const std::uint32_t first_block = first / kSurfelsPerBlock;
    numbers.resize(DivideRoundingUp(end, kSurfelsPerBlock) - first_block);
    std::iota(numbers.begin(), numbers.end(), first_block);
  }
  Set(device, numbers);
}

void BlockList::SetFlagged(const std::shared_ptr<Device>& device, const Buffer& flags,
                           std::uint32_t end, std::span<const std::uint32_t> blocks) {
  std::vector<std::uint32_t> is_flagged(end);
  flags.Download(std::span(is_flagged));
  std::vector<std::uint32_t> numbers;
  std::ranges::copy_if(blocks, std::back_inserter(numbers),
                       [&](std::uint32_t block) { return is_flagged[block] != 0; });
  Set(device, numbers);
}

BlockCuller::BlockCuller(const std::shared_ptr<Device>& device)
    : device_(device),
      bound_(device, {"fusion/bound_blocks", fusion_bound_blocks_spirv}),
      cull_(device, {"fusion/cull_blocks", fusion_cull_blocks_spirv}) {}

void BlockCuller::Bound(Recorder& recorder, const BlockList& blocks, std::uint32_t num_surfels,
                        const SurfelStorage& surfels) const {
  if (blocks.size() == 0) return;
  BoundBlocksParams params{};
  params.num_blocks = blocks.size();
  params.num_surfels = num_surfels;
  recorder.Dispatch(bound_,
                    {surfels.position_radius(), surfels.normal_weight(), blocks.buffer(),
                     surfels.bounds(), surfels.num_there()},
                    params, GridFor(bound_, blocks.size()));
}

void BlockCuller::FindVisible(Recorder& recorder, std::span<const ModelView> views,
                              std::uint32_t margin_px, SurfelStorage& surfels, BlockList& visible,
                              StageTimes* times) {
  surfels.BeginView();
  Cull(recorder, views, margin_px, surfels, visible, times);
  if (!surfels.HasAnchorsOut()) return;
  std::vector<std::uint32_t> seen;
  for (const SurfelStorage::Outside& outside : surfels.AnchorsOut()) {
    const bool is_seen = std::ranges::any_of(views, [&](const ModelView& view) {
      return MaySee(Enlarged(view.params, margin_px, 0), view.anchors, outside);
    });
    if (is_seen) seen.push_back(outside.anchor);
  }
  if (seen.empty()) return;
  for (const std::uint32_t anchor : seen) surfels.BringIn(anchor);
  Cull(recorder, views, margin_px, surfels, visible, times);
}

// Of what is on the device.
void BlockCuller::Cull(Recorder& recorder, std::span<const ModelView> views,
                       std::uint32_t margin_px, SurfelStorage& surfels, BlockList& visible,
                       StageTimes* times) {
  const std::vector<std::uint32_t>& order = surfels.order();
  if (order.empty()) {
    visible.Set(device_, {});
    return;
  }
  const std::uint32_t num_blocks = DivideRoundingUp(surfels.size(), kSurfelsPerBlock);
  const std::vector<std::uint32_t> unbounded = surfels.Unbounded();
  if (!unbounded.empty()) {
    new_blocks_.Set(device_, unbounded);
    Bound(recorder, new_blocks_, surfels.size(), surfels);
    surfels.SetBounded();
  }
  if (is_seen_.size_bytes() < num_blocks * sizeof(std::uint32_t)) {
    is_seen_ = Buffer(device_, num_blocks * sizeof(std::uint32_t) * 3 / 2, "fusion/seen_blocks");
  }
  recorder.Fill(is_seen_, 0);
  for (const ModelView& view : views) {
    recorder.Dispatch(
        cull_, {surfels.bounds(), surfels.anchor_of_block(), view.anchors.buffer(), is_seen_},
        Enlarged(view.params, margin_px, surfels.size()), GridFor(cull_, num_blocks));
  }
  recorder.Submit(times);
  visible.SetFlagged(device_, is_seen_, num_blocks, order);
  surfels.Seen(visible.numbers());
}

}  // namespace mono3d
