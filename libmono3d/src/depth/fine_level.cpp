// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/fine_level.h"

#include <algorithm>
#include <span>
#include <utility>

#include "depth/buffers.h"
#include "depth/fine_volume.h"

namespace mono3d {
namespace {

// Of four paths.
std::uint64_t PathBytes(LevelSize size) {
  return std::uint64_t{kFinePlanes} * (kNumPaths / 2) * NumFinePixels(size);
}

std::uint64_t CensusBytes(LevelSize size, std::size_t num_sources) {
  return std::uint64_t{8} * (1 + num_sources) * NumFineCensusTexels(size);
}

}  // namespace

FineLevel::FineLevel(std::shared_ptr<Device> device, DepthKernels& kernels,
                     const DepthEstimatorOptions& options)
    : device_(std::move(device)),
      kernels_(kernels),
      options_(options),
      penalties_(UploadPenalties(device_, options.sgm)) {}

std::uint64_t FineLevel::LargestBufferBytes(LevelSize size, std::size_t num_sources) {
  return std::max(PathBytes(size), CensusBytes(size, num_sources));
}

void FineLevel::RecordPrior(Recorder& recorder, const Level& level, const Buffer& images,
                            const Buffer& coarse_depth) {
  const LevelSize coarse = SizeAtLevel(level.coarse_camera, 0);
  const SweepPlan& plan = level.plan;
  const CameraModel& camera = level.coarse_camera;
  const std::size_t range_bytes = 2 * sizeof(std::uint32_t) * NumFinePixels(plan.size);
  Reserve(coarse_normals_, device_, 3 * sizeof(float) * coarse.num_pixels(),
          "depth/coarse_normals");
  Reserve(ranges_, device_, range_bytes, "depth/ranges");
  kernels_.Normals(recorder,
                   {.width_px = coarse.width_px,
                    .height_px = coarse.height_px,
                    .fx = static_cast<float>(camera.fx),
                    .fy = static_cast<float>(camera.fy),
                    .cx = static_cast<float>(camera.cx),
                    .cy = static_cast<float>(camera.cy),
                    .tolerance = static_cast<float>(2 * plan.step)},
                   coarse_depth, coarse_normals_);
  kernels_.Prior(recorder,
                 {.coarse_width_px = coarse.width_px,
                  .coarse_height_px = coarse.height_px,
                  .width_px = plan.size.width_px,
                  .height_px = plan.size.height_px,
                  .num_planes = plan.num_planes,
                  .fx = static_cast<float>(camera.fx),
                  .fy = static_cast<float>(camera.fy),
                  .cx = static_cast<float>(camera.cx),
                  .cy = static_cast<float>(camera.cy),
                  .inverse_depth = static_cast<float>(plan.inverse_depth),
                  .inverse_depth_step = static_cast<float>(plan.step),
                  .follow_normals = options_.sgm.follow_normals ? 1u : 0u},
                 coarse_depth, coarse_normals_, images, volumes());
}

std::uint32_t FineLevel::NumPaths(const Level& level) const {
  return level.is_last ? static_cast<std::uint32_t>(options_.sgm.finest_paths) : kNumPaths;
}

void FineLevel::RecordSweep(Recorder& recorder, const Level& level,
                            const SourceProjections& projections, const Buffer& images) {
  const SweepPlan& plan = level.plan;
  const std::size_t num_sources = projections.size();
  const auto index = static_cast<std::size_t>(plan.level);
  if (projections_.size() <= index) projections_.resize(index + 1);
  Reserve(projections_[index], device_, kMaxProjectionBytes, "depth/projections");
  const std::vector<float> packed = Pack(projections, plan.size);
  projections_[index].Upload(std::span<const float>(packed));
  const std::size_t num_pixels = NumFinePixels(plan.size);
  Reserve(census_, device_, CensusBytes(plan.size, num_sources), "depth/fine_census");
  Reserve(costs_, device_, kFinePlanes * num_pixels, "depth/fine_costs");
  Reserve(paths_, device_, PathBytes(plan.size), "depth/paths");
  // Bound even where it is not written.
  Reserve(more_paths_, device_, NumPaths(level) > kFewPaths ? PathBytes(plan.size) : 16,
          "depth/more_paths");
  const std::uint32_t quarter_turns = PackQuarterTurns(projections);
  kernels_.FineCensus(recorder, images, plan.size, static_cast<std::uint32_t>(1 + num_sources),
                      quarter_turns, census_);
  kernels_.FineSweep(recorder, {num_sources, options_.plane_sweep.side_tolerance},
                     {.width_px = plan.size.width_px,
                      .height_px = plan.size.height_px,
                      .inverse_depth = static_cast<float>(plan.inverse_depth),
                      .inverse_depth_step = static_cast<float>(plan.step),
                      .quarter_turns = quarter_turns},
                     census_, projections_[index], volumes());
}

WinnerSelection& FineLevel::SelectionOf(int level) {
  while (winner_selections_.size() <= static_cast<std::size_t>(level)) {
    winner_selections_.emplace_back(device_, kernels_, options_);
  }
  return winner_selections_[static_cast<std::size_t>(level)];
}

void FineLevel::RecordWinnerSelection(Recorder& recorder, const Level& level) {
  const SweepPlan& plan = level.plan;
  WinnerSelection& selection = SelectionOf(plan.level);
  selection.Prepare(plan.size);
  kernels_.FineSgm(recorder, penalties_, NumPaths(level), options_.winner_takes_all.sub_plane,
                   {.width_px = plan.size.width_px,
                    .height_px = plan.size.height_px,
                    .max_cost = selection.MaxCost(level.is_last),
                    .min_uniqueness = selection.MinUniqueness(level.is_last),
                    .inverse_depth = static_cast<float>(plan.inverse_depth),
                    .inverse_depth_step = static_cast<float>(plan.step)},
                   volumes(), selection.winners());
  selection.RecordMedian(recorder, plan, level.is_last);
}

void FineLevel::Record(Recorder& recorder, const Level& level, const SourceProjections& projections,
                       const Buffer& images, const Buffer& coarse_depth) {
  RecordPrior(recorder, level, images, coarse_depth);
  RecordSweep(recorder, level, projections, images);
  RecordWinnerSelection(recorder, level);
}

}  // namespace mono3d
