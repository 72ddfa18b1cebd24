// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/local_matcher.h"

#include <algorithm>
#include <span>
#include <utility>

#include "depth/buffers.h"
#include "depth/local_volume.h"

namespace mono3d {
namespace {

// Of four paths.
std::uint64_t PathBytes(LevelSize size) {
  return std::uint64_t{kLocalPlanes} * (kNumPaths / 2) * NumLocalPixels(size);
}

std::uint64_t CensusBytes(LevelSize size, std::size_t num_sources) {
  return std::uint64_t{16} * (1 + num_sources) * NumLocalCensusTexels(size);
}

}  // namespace

LocalMatcher::LocalMatcher(std::shared_ptr<Device> device, const DepthEstimatorOptions& options)
    : device_(std::move(device)),
      options_(options),
      normals_stage_(device_),
      prior_(device_),
      local_census_(device_),
      sweep_(device_, static_cast<std::uint32_t>(options.plane_sweep.side_tolerance)),
      sgm_(device_, options.sgm),
      winner_(device_, kNumPaths, options.winner_takes_all.sub_plane),
      last_winner_(device_, static_cast<std::uint32_t>(options.sgm.finest_paths),
                   options.winner_takes_all.sub_plane),
      choice_(device_, options) {}

std::uint64_t LocalMatcher::LargestBufferBytes(LevelSize size, std::size_t num_sources) {
  return std::max(PathBytes(size), CensusBytes(size, num_sources));
}

void LocalMatcher::RecordPrior(Recorder& recorder, const Level& level, const Buffer& images,
                               const Buffer& coarse_depth) {
  const LevelSize coarse = SizeAtLevel(level.coarse_camera, 0);
  const SweepPlan& plan = level.plan;
  const CameraModel& camera = level.coarse_camera;
  const std::size_t range_bytes = 2 * sizeof(std::uint32_t) * NumLocalPixels(plan.size);
  Reserve(coarse_normals_, device_, 3 * sizeof(float) * coarse.num_pixels(),
          "depth/coarse_normals");
  Reserve(ranges_, device_, range_bytes, "depth/ranges");
  normals_stage_.Record(recorder,
                        {.width_px = coarse.width_px,
                         .height_px = coarse.height_px,
                         .fx = static_cast<float>(camera.fx),
                         .fy = static_cast<float>(camera.fy),
                         .cx = static_cast<float>(camera.cx),
                         .cy = static_cast<float>(camera.cy),
                         .tolerance = static_cast<float>(2 * plan.step)},
                        coarse_depth, coarse_normals_);
  prior_.Record(recorder,
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
                coarse_depth, coarse_normals_, images, ranges_);
}

std::uint32_t LocalMatcher::NumPaths(const Level& level) const {
  return level.is_last ? static_cast<std::uint32_t>(options_.sgm.finest_paths) : kNumPaths;
}

void LocalMatcher::RecordSweep(Recorder& recorder, const Level& level,
                               const SourceProjections& projections, const Buffer& images) {
  const SweepPlan& plan = level.plan;
  const std::size_t num_sources = projections.size();
  const auto index = static_cast<std::size_t>(plan.level);
  if (projections_.size() <= index) projections_.resize(index + 1);
  Reserve(projections_[index], device_, kMaxProjectionBytes, "depth/projections");
  const std::vector<float> packed = Pack(projections);
  projections_[index].Upload(std::span<const float>(packed));
  const std::size_t num_pixels = NumLocalPixels(plan.size);
  Reserve(census_, device_, CensusBytes(plan.size, num_sources), "depth/local_census");
  Reserve(costs_, device_, kLocalPlanes * num_pixels, "depth/local_costs");
  Reserve(paths_, device_, PathBytes(plan.size), "depth/paths");
  // Bound even where it is not written.
  Reserve(more_paths_, device_, NumPaths(level) > kFewPaths ? PathBytes(plan.size) : 16,
          "depth/more_paths");
  local_census_.Record(recorder, images, plan.size, static_cast<std::uint32_t>(1 + num_sources),
                       census_);
  sweep_.Record(recorder, num_sources,
                {.width_px = plan.size.width_px,
                 .height_px = plan.size.height_px,
                 .inverse_depth = static_cast<float>(plan.inverse_depth),
                 .inverse_depth_step = static_cast<float>(plan.step)},
                census_, projections_[index], ranges_, costs_);
  sgm_.Record(recorder, plan.size, costs_, ranges_, paths_, more_paths_, NumPaths(level));
}

void LocalMatcher::RecordChoice(Recorder& recorder, const Level& level) {
  const SweepPlan& plan = level.plan;
  choice_.Prepare(plan.size);
  const LocalWinnerStage& winner = level.is_last ? last_winner_ : winner_;
  winner.Record(recorder,
                {.width_px = plan.size.width_px,
                 .height_px = plan.size.height_px,
                 .max_cost = choice_.MaxCost(level.is_last),
                 .min_uniqueness = choice_.MinUniqueness(level.is_last),
                 .inverse_depth = static_cast<float>(plan.inverse_depth),
                 .inverse_depth_step = static_cast<float>(plan.step)},
                paths_, more_paths_, costs_, ranges_, choice_.winner_depth(),
                choice_.winner_uniqueness());
  choice_.RecordMedian(recorder, plan, level.is_last);
}

void LocalMatcher::Record(Recorder& recorder, const Level& level,
                          const SourceProjections& projections, const Buffer& images,
                          const Buffer& coarse_depth) {
  RecordPrior(recorder, level, images, coarse_depth);
  RecordSweep(recorder, level, projections, images);
  RecordChoice(recorder, level);
}

}  // namespace mono3d
