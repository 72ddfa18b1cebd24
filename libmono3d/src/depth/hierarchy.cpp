// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "depth/buffers.h"
#include "depth/contrast.h"
#include "depth/padded_image.h"
#include "gpu/device_handle.h"

namespace mono3d {
namespace {

// The sweep that only looks for the range does so on images of a quarter of the size or less.
constexpr int kRangeSearchLevel = 2;
// Below this the coarsest level shows too little for windows and paths.
constexpr std::uint32_t kMinCoarseSide = 48;
// What shows no points may be nearer than all that does: the crowns of trees above a road, a
// worktop before the wall. Half as far away costs some planes of the coarsest level, and was found
// to mislead nothing (decision 20).
constexpr double kNearerThanPoints = 2;

}  // namespace

Hierarchy::Hierarchy(std::shared_ptr<Device> device, DepthKernels& kernels,
                     const DepthEstimatorOptions& options)
    : device_(std::move(device)),
      kernels_(kernels),
      options_(options),
      coarse_level_(device_, kernels, options),
      fine_level_(device_, kernels, options) {}

void Hierarchy::Upload(const ImageBundle& bundle, const GreyImages& greys) {
  const LevelSize size = SizeAtLevel(bundle.reference().frame.camera, 0);
  const std::size_t image_bytes = 4 * PaddedWords(size);
  if (levels_.empty()) levels_.emplace_back();
  std::vector<std::optional<std::size_t>> images = IndicesOfSources(bundle);
  images.insert(images.begin(), bundle.reference_index());
  num_images_ = images.size();
  Reserve(levels_[0], device_, image_bytes * num_images_, "depth/pyramid");
  Reserve(contrast_gains_, device_, sizeof(std::uint32_t) * num_images_, "depth/contrast_gains");
  const Frame& reference_frame = bundle.reference().frame;
  const double contrast = ContrastOf(greys.reference(reference_frame.ContentOrAll()));
  std::vector<std::uint32_t> gains(num_images_, kGainSteps);
  for (std::size_t slot = 0; slot < num_images_; ++slot) {
    // What a source that sees nothing shows does not matter.
    const bool is_other = slot > 0 && images[slot].has_value();
    const Frame& frame = is_other ? bundle.keyframes[*images[slot]].frame : reference_frame;
    const cv::Mat& grey = is_other ? greys.sources[slot - 1] : greys.reference;
    const std::vector<std::uint32_t> words = PackPadded(grey);
    levels_[0].Upload(std::span<const std::uint32_t>(words), slot * image_bytes);
    if (!is_other) continue;
    const double own_contrast = ContrastOf(grey(frame.ContentOrAll()));
    gains[slot] =
        static_cast<std::uint32_t>(std::lround(kGainSteps * ContrastGain(contrast, own_contrast)));
  }
  contrast_gains_.Upload(std::span<const std::uint32_t>(gains));
}

void Hierarchy::RecordPyramid(Recorder& recorder, const LevelSize& full, int level) {
  LevelSize size = full;
  for (std::size_t fine = 0; fine < static_cast<std::size_t>(level); ++fine) {
    if (levels_.size() <= fine + 1) levels_.emplace_back();
    Reserve(levels_[fine + 1], device_, 4 * PaddedWords(size.Halved()) * num_images_,
            "depth/pyramid");
    kernels_.Pyramid(recorder, levels_[fine], size, static_cast<std::uint32_t>(num_images_),
                     levels_[fine + 1]);
    size = size.Halved();
  }
}

SweepLimits Hierarchy::LimitsFrom(int level) const {
  return {.level = level,
          .max_planes = static_cast<std::uint32_t>(options_.plane_sweep.max_planes),
          .max_buffer_bytes = Limits(*device_).max_storage_buffer_bytes,
          .padded_planes = [this](std::uint32_t n) { return kernels_.PaddedPlanes(n); }};
}

std::optional<InverseDepthRange> Hierarchy::FindRange(Recorder& recorder, const ImageBundle& bundle,
                                                      const SweepGeometry& geometry,
                                                      StageTimes* times) {
  const PlaneSweepOptions& sweep = options_.plane_sweep;
  std::optional<InverseDepthRange> range;
  if (sweep.min_depth_su <= 0 || sweep.max_depth_su <= 0) {
    range = RangeOfDepths(bundle.reference().sparse_depths_su);
    if (!range) {
      std::vector<float> depths;
      for (const Keyframe& keyframe : bundle.keyframes) {
        depths.insert(depths.end(), keyframe.sparse_depths_su.begin(),
                      keyframe.sparse_depths_su.end());
      }
      range = RangeOfDepths(depths);
    }
    if (!range) range = SearchRange(recorder, geometry, times);
    if (!range) return std::nullopt;
  } else {
    range = InverseDepthRange{};
  }
  if (sweep.min_depth_su > 0) range->nearest = 1 / sweep.min_depth_su;
  if (sweep.max_depth_su > 0) range->farthest = 1 / sweep.max_depth_su;
  if (range->farthest >= range->nearest) return std::nullopt;
  return range;
}

std::optional<InverseDepthRange> Hierarchy::SearchRange(Recorder& recorder,
                                                        const SweepGeometry& geometry,
                                                        StageTimes* times) {
  const std::optional<InverseDepthRange> widest = geometry.WidestRange();
  if (!widest) return std::nullopt;
  const SweepPlan plan = PlanSweep(geometry, *widest, LimitsFrom(kRangeSearchLevel));
  RecordPyramid(recorder, SizeAtLevel(geometry.camera(), 0), plan.level);
  coarse_level_.Record(recorder, plan, geometry.Projections(plan.level),
                       levels_[static_cast<std::size_t>(plan.level)], true);
  recorder.Submit(times);
  std::vector<float> depths(plan.size.num_pixels());
  coarse_level_.results().inverse_depth().Download(std::span<float>(depths));
  for (float& depth : depths) depth = depth > 0 ? 1 / depth : 0;
  return RangeOfDepths(depths);
}

SweepPlan Hierarchy::Record(Recorder& recorder, const SweepGeometry& geometry,
                            const InverseDepthRange& range) {
  const CameraModel& camera = geometry.camera();
  const int finest = FinestLevel(camera);
  const SweepLimits limits = LimitsFrom(CoarsestLevel(camera, finest));
  SweepPlan plan = PlanSweep(geometry, range, limits);
  if (!(options_.plane_sweep.min_depth_su > 0)) {
    AddNearerPlanes(geometry, kNearerThanPoints * range.nearest, limits, plan);
  }
  RecordPyramid(recorder, SizeAtLevel(camera, 0), std::max(plan.level, kDetailLevel));
  coarse_level_.Record(recorder, plan, geometry.Projections(plan.level),
                       levels_[static_cast<std::size_t>(plan.level)], plan.level <= finest);
  results_.assign(1, {plan, &coarse_level_.results()});
  while (plan.level > finest) {
    const CameraModel coarse_camera = HalvedCamera(camera, plan.level);
    plan = Finer(plan, camera);
    fine_level_.Record(
        recorder, {.coarse_camera = coarse_camera, .plan = plan, .is_last = plan.level == finest},
        geometry.Projections(plan.level), levels_[static_cast<std::size_t>(plan.level)],
        results_.back().selection->inverse_depth());
    results_.push_back({plan, &fine_level_.results(plan.level)});
  }
  return plan;
}

// That of the options, or the first whose volumes fit the device's buffers.
int Hierarchy::FinestLevel(const CameraModel& camera) const {
  int level = options_.pyramid.level;
  while (FineLevel::LargestBufferBytes(SizeAtLevel(camera, level), num_images_ - 1) >
         Limits(*device_).max_storage_buffer_bytes) {
    ++level;
  }
  return level;
}

int Hierarchy::CoarsestLevel(const CameraModel& camera, int finest) const {
  const int num_levels = options_.pyramid.num_levels;
  int level = finest;
  while (num_levels == 0 || level - finest + 1 < num_levels) {
    const LevelSize coarser = SizeAtLevel(camera, level + 1);
    if (std::min(coarser.width_px, coarser.height_px) < kMinCoarseSide) break;
    ++level;
  }
  return level;
}

}  // namespace mono3d
