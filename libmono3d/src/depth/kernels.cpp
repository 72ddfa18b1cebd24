// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/kernels.h"

#include <numeric>
#include <vector>

#include "depth/census.params.h"
#include "depth/census.spirv.h"
#include "depth/detail.spirv.h"
#include "depth/dog.params.h"
#include "depth/dog.spirv.h"
#include "depth/fine_census.params.h"
#include "depth/fine_census.spirv.h"
#include "depth/fine_sgm.params.h"
#include "depth/fine_sgm.spirv.h"
#include "depth/fine_sweep.spirv.h"
#include "depth/fine_volume.h"
#include "depth/host/host_kernels.h"
#include "depth/inference.spirv.h"
#include "depth/inference_data.params.h"
#include "depth/inference_data.spirv.h"
#include "depth/inference_expand.params.h"
#include "depth/inference_expand.spirv.h"
#include "depth/inference_halve.params.h"
#include "depth/inference_halve.spirv.h"
#include "depth/inference_normals.spirv.h"
#include "depth/inference_relax.params.h"
#include "depth/inference_relax.spirv.h"
#include "depth/inference_tiles.h"
#include "depth/measurement.h"
#include "depth/median.spirv.h"
#include "depth/normals.spirv.h"
#include "depth/photometric.spirv.h"
#include "depth/plane_sweep.spirv.h"
#include "depth/prior.spirv.h"
#include "depth/pyramid.params.h"
#include "depth/pyramid.spirv.h"
#include "depth/sgm.params.h"
#include "depth/sgm.spirv.h"
#include "depth/surface.spirv.h"
#include "depth/texture_filter.spirv.h"
#include "depth/upsample.spirv.h"
#include "depth/winner_takes_all.spirv.h"
#include "gpu/device_handle.h"

namespace mono3d {
namespace {

using Constants = std::vector<std::uint32_t>;
using Grid = std::array<std::uint32_t, 3>;

// Pixels of an invocation, as the shaders say.
constexpr std::uint32_t kPixelsOfAGroup = 4;
constexpr std::uint64_t kCensusRows = 2;
constexpr std::uint32_t kFineSweepColumns = 2;
constexpr std::uint64_t kFineSweepRows = 16;  // in blocks of 2x2
constexpr std::uint64_t kDetailRows = 4;
constexpr std::uint64_t kPhotometricRows = 16;
constexpr std::uint64_t kSurfaceColumnsAndRows = 2;
constexpr std::uint32_t kInferenceRowGroups = kInferenceTileHeight / 2;  // of a tile

// An invocation for each of `columns` times `rows`, times `layers`.
Grid GridOf(const Kernel& kernel, std::uint64_t columns, std::uint32_t rows,
            std::uint32_t layers = 1) {
  return {DivideRoundingUp(columns, kernel.workgroup_size()[0]), rows, layers};
}

// Of kernels that take rows of whole texels of four pixels as such.
std::uint32_t HasWholeTexels(std::uint32_t width_px) {
  return width_px % kPixelsOfAGroup == 0 ? 1u : 0u;
}

std::uint64_t GroupsOfFour(std::uint32_t width_px) {
  return (width_px + kPixelsOfAGroup - 1) / kPixelsOfAGroup;
}

Constants ConstantsOf(const SweepSources& sources) {
  return {static_cast<std::uint32_t>(sources.num_sources / 2),
          static_cast<std::uint32_t>(sources.side_tolerance)};
}

Constants FineSweepConstants(const SweepSources& sources, std::uint32_t quarter_turns) {
  Constants constants = ConstantsOf(sources);
  constants.push_back(quarter_turns != 0 ? 1u : 0u);
  return constants;
}

// Of the last of so many directions; of the others as of one.
Constants FineSgmConstants(std::uint32_t num_paths, bool sub_plane) {
  return {num_paths - 1, sub_plane ? 1u : 0u};
}

// Of one direction, without what finds winners.
FineSgmParams ParamsOfPath(LevelSize size, const SgmPenalties& penalties, std::uint32_t path) {
  const auto& [step_x, step_y] = kPathDirections[path];
  return {.width_px = size.width_px,
          .height_px = size.height_px,
          .step_x = step_x,
          .step_y = step_y,
          .direction = path,
          .p1 = penalties.p1,
          .min_p2 = penalties.min_p2,
          .p2_times_gradient = penalties.p2_times_gradient,
          .gradient = penalties.gradient,
          .first_texel = path % 4 * static_cast<std::uint32_t>(NumFinePixels(size)),
          .max_cost = 0,
          .min_uniqueness = 0,
          .inverse_depth = 0,
          .inverse_depth_step = 0};
}

Grid GridOfPath(const Kernel& kernel, LevelSize size, std::uint32_t path) {
  const bool is_row = kPathDirections[path][1] == 0;
  return GridOf(kernel, is_row ? size.height_px : size.width_px, 1);
}

}  // namespace

DepthKernels::DepthKernels(const std::shared_ptr<Device>& device)
    : num_lanes_(Limits(*device).subgroup_size),
      pyramid_(device, {"depth/pyramid", depth_pyramid_spirv, kPyramidOnHost}),
      census_(device, {"depth/census", depth_census_spirv}),
      plane_sweep_(device, {"depth/plane_sweep", depth_plane_sweep_spirv}),
      sgm_(device, {"depth/sgm", depth_sgm_spirv}),
      winner_takes_all_(device, {"depth/winner_takes_all", depth_winner_takes_all_spirv}),
      prior_(device, {"depth/prior", depth_prior_spirv}),
      fine_census_(device, {"depth/fine_census", depth_fine_census_spirv, kFineCensusOnHost}),
      fine_sweep_(device, {"depth/fine_sweep", depth_fine_sweep_spirv}),
      fine_sgm_(device, {"depth/fine_sgm", depth_fine_sgm_spirv, kFineSgmOnHost}),
      median_(device, {"depth/median", depth_median_spirv}),
      normals_(device, {"depth/normals", depth_normals_spirv}),
      upsample_(device, {"depth/upsample", depth_upsample_spirv}),
      detail_(device, {"depth/detail", depth_detail_spirv, kDetailOnHost}),
      photometric_(device, {"depth/photometric", depth_photometric_spirv}),
      surface_(device, {"depth/surface", depth_surface_spirv, kSurfaceOnHost}),
      dog_(device, {"depth/dog", depth_dog_spirv, kDogOnHost}),
      texture_filter_(device,
                      {"depth/texture_filter", depth_texture_filter_spirv, kTextureFilterOnHost}),
      inference_data_(device, {"depth/inference_data", depth_inference_data_spirv}),
      inference_halve_(device, {"depth/inference_halve", depth_inference_halve_spirv}),
      inference_expand_(device, {"depth/inference_expand", depth_inference_expand_spirv}),
      inference_relax_(
          device, {"depth/inference_relax", depth_inference_relax_spirv, kInferenceRelaxOnHost}),
      inference_(device, {"depth/inference", depth_inference_spirv, kInferenceOnHost}),
      inference_normals_(device, {"depth/inference_normals", depth_inference_normals_spirv}) {}

void DepthKernels::Prepare(const DepthEstimatorOptions& options) {
  const SweepSources sources{kBundleSize - 1, options.plane_sweep.side_tolerance};
  const bool sub_plane = options.winner_takes_all.sub_plane;
  for (KernelVariants* kernel :
       {&pyramid_, &census_, &prior_, &fine_census_, &upsample_, &detail_, &dog_}) {
    kernel->With();
  }
  if (options.inference.enabled) {
    for (KernelVariants* kernel :
         {&inference_data_, &inference_halve_, &inference_expand_, &inference_relax_}) {
      kernel->With();
    }
    inference_.With({static_cast<std::uint32_t>(sources.num_sources / 2)});
    inference_normals_.With({1u});
  }
  normals_.With({1u});
  texture_filter_.With({1u});
  plane_sweep_.With(ConstantsOf(sources));
  fine_sweep_.With(FineSweepConstants(sources, 0));
  photometric_.With({static_cast<std::uint32_t>(sources.num_sources / 2)});
  winner_takes_all_.With({sub_plane ? 1u : 0u});
  for (const std::uint32_t num_paths :
       {1u, kNumPaths, static_cast<std::uint32_t>(options.sgm.finest_paths)}) {
    fine_sgm_.With(FineSgmConstants(num_paths, num_paths == 1 || sub_plane));
  }
  for (const std::uint32_t with_confidence : {0u, 1u}) {
    median_.With({with_confidence, 1u});
    surface_.With({with_confidence});
  }
}

void DepthKernels::Pyramid(Recorder& recorder, const Buffer& fine, LevelSize size,
                           std::uint32_t num_images, const Buffer& coarse) {
  const Kernel& kernel = pyramid_.With();
  const LevelSize half = size.Halved();
  recorder.Dispatch(kernel, {fine, coarse}, PyramidParams{size.width_px, size.height_px},
                    GridOf(kernel, PaddedWordsPerRow(half), PaddedRows(half), num_images));
}

void DepthKernels::Census(Recorder& recorder, const Buffer& images, LevelSize size,
                          std::uint32_t num_images, std::uint32_t quarter_turns,
                          const Buffer& census) {
  const Kernel& kernel = census_.With();
  recorder.Dispatch(kernel, {images, census},
                    CensusParams{size.width_px, size.height_px, quarter_turns},
                    GridOf(kernel, size.groups_per_row(),
                           DivideRoundingUp(size.height_px, kCensusRows), num_images));
}

void DepthKernels::PlaneSweep(Recorder& recorder, const SweepSources& sources,
                              const PlaneSweepParams& params, const Buffer& census,
                              const Buffer& projections, const Buffer& costs) {
  const Kernel& kernel = plane_sweep_.With(ConstantsOf(sources));
  recorder.Dispatch(kernel, {census, projections, costs}, params,
                    GridOf(kernel, params.width_px, params.height_px));
}

std::uint32_t DepthKernels::PaddedPlanes(std::uint32_t num_planes) const {
  // The sweep writes 16 planes at a time, a lane holds whole words of 4.
  const std::uint32_t unit = std::lcm(16u, 4 * num_lanes_);
  return DivideRoundingUp(num_planes, unit) * unit;
}

void DepthKernels::Sgm(Recorder& recorder, LevelSize size, std::uint32_t padded_planes,
                       const SgmPenalties& penalties, const Buffer& images, const Buffer& costs,
                       const Buffer& sums) {
  const Kernel& kernel = sgm_.With({num_lanes_, padded_planes / num_lanes_});
  for (std::uint32_t i = 0; i < kNumPaths; ++i) {
    const auto& [step_x, step_y] = kPathDirections[i];
    const std::uint32_t num_scanlines = step_y == 0 ? size.height_px : size.width_px;
    recorder.Dispatch(kernel, {costs, images, penalties.p2, sums, sums},
                      SgmParams{.width_px = size.width_px,
                                .height_px = size.height_px,
                                .step_x = step_x,
                                .step_y = step_y,
                                .p1 = penalties.p1,
                                .is_first = i == 0 ? 1u : 0u},
                      GridOf(kernel, std::uint64_t{num_scanlines} * num_lanes_, 1));
  }
}

void DepthKernels::WinnerTakesAll(Recorder& recorder, bool sub_plane,
                                  const WinnerTakesAllParams& params, const Buffer& sums,
                                  const Buffer& costs, const EstimateBuffers& winners) {
  const Kernel& kernel = winner_takes_all_.With({sub_plane ? 1u : 0u});
  recorder.Dispatch(kernel, {sums, costs, winners.inverse_depth, winners.confidence}, params,
                    GridOf(kernel, params.width_px, params.height_px));
}

void DepthKernels::Prior(Recorder& recorder, const PriorParams& params, const Buffer& coarse_depth,
                         const Buffer& coarse_normals, const Buffer& images,
                         const FineVolumes& volumes) {
  const Kernel& kernel = prior_.With();
  recorder.Dispatch(kernel, {coarse_depth, coarse_normals, images, volumes.ranges}, params,
                    GridOf(kernel, params.coarse_width_px, params.coarse_height_px));
}

void DepthKernels::FineCensus(Recorder& recorder, const Buffer& images, LevelSize size,
                              std::uint32_t num_images, std::uint32_t quarter_turns,
                              const Buffer& census) {
  const Kernel& kernel = fine_census_.With();
  recorder.Dispatch(kernel, {images, census},
                    FineCensusParams{size.width_px, size.height_px, quarter_turns},
                    GridOf(kernel, size.groups_per_row(),
                           DivideRoundingUp(size.height_px, kCensusRows), num_images));
}

void DepthKernels::FineSweep(Recorder& recorder, const SweepSources& sources,
                             const FineSweepParams& params, const Buffer& census,
                             const Buffer& projections, const FineVolumes& volumes) {
  const Kernel& kernel = fine_sweep_.With(FineSweepConstants(sources, params.quarter_turns));
  recorder.Dispatch(kernel, {census, projections, volumes.ranges, volumes.costs}, params,
                    GridOf(kernel, (params.width_px + kFineSweepColumns - 1) / kFineSweepColumns,
                           DivideRoundingUp(params.height_px, kFineSweepRows)));
}

void DepthKernels::FinePath(Recorder& recorder, LevelSize size, const SgmPenalties& penalties,
                            std::uint32_t path, const FineVolumes& volumes) {
  const Kernel& kernel = fine_sgm_.With(FineSgmConstants(1, true));
  const Buffer& to = path < 4 ? volumes.paths : volumes.more_paths;
  // What only the last direction reads and writes is bound to anything.
  recorder.Dispatch(kernel,
                    {volumes.costs, volumes.ranges, volumes.costs, volumes.costs, to, to, to},
                    ParamsOfPath(size, penalties, path), GridOfPath(kernel, size, path));
}

void DepthKernels::FineSgm(Recorder& recorder, const SgmPenalties& penalties,
                           std::uint32_t num_paths, bool sub_plane, const FineWinnerParams& params,
                           const FineVolumes& volumes, const EstimateBuffers& winners) {
  const LevelSize size{params.width_px, params.height_px};
  const std::uint32_t last = num_paths - 1;
  for (std::uint32_t path = 0; path < last; ++path) {
    FinePath(recorder, size, penalties, path, volumes);
  }
  FineSgmParams of_last = ParamsOfPath(size, penalties, last);
  of_last.max_cost = params.max_cost;
  of_last.min_uniqueness = params.min_uniqueness;
  of_last.inverse_depth = params.inverse_depth;
  of_last.inverse_depth_step = params.inverse_depth_step;
  const Kernel& kernel = fine_sgm_.With(FineSgmConstants(num_paths, sub_plane));
  recorder.Dispatch(kernel,
                    {volumes.costs, volumes.ranges, volumes.paths, volumes.more_paths,
                     winners.confidence, winners.inverse_depth, winners.confidence},
                    of_last, GridOfPath(kernel, size, last));
}

void DepthKernels::Median(Recorder& recorder, bool with_confidence, const MedianParams& params,
                          const EstimateBuffers& from, const EstimateBuffers& to) {
  const Kernel& kernel = median_.With({with_confidence ? 1u : 0u, HasWholeTexels(params.width_px)});
  recorder.Dispatch(kernel, {from.inverse_depth, from.confidence, to.inverse_depth, to.confidence},
                    params, GridOf(kernel, GroupsOfFour(params.width_px), params.height_px));
}

void DepthKernels::Normals(Recorder& recorder, const NormalsParams& params,
                           const Buffer& inverse_depth, const Buffer& normals) {
  const Kernel& kernel = normals_.With({HasWholeTexels(params.width_px)});
  recorder.Dispatch(kernel, {inverse_depth, normals}, params,
                    GridOf(kernel, GroupsOfFour(params.width_px), params.height_px));
}

void DepthKernels::Upsample(Recorder& recorder, const UpsampleParams& params,
                            const EstimateBuffers& coarse, const EstimateBuffers& fine) {
  const Kernel& kernel = upsample_.With();
  recorder.Dispatch(kernel,
                    {coarse.inverse_depth, coarse.confidence, fine.inverse_depth, fine.confidence},
                    params, GridOf(kernel, params.width_px, params.height_px));
}

void DepthKernels::Detail(Recorder& recorder, const DetailParams& params, std::uint32_t num_images,
                          const Buffer& images, const Buffer& quarter, const Buffer& gains,
                          const Buffer& detail) {
  const Kernel& kernel = detail_.With();
  recorder.Dispatch(kernel, {images, quarter, gains, detail}, params,
                    GridOf(kernel, GroupsOfFour(params.width_px),
                           DivideRoundingUp(params.height_px, kDetailRows), num_images));
}

void DepthKernels::Photometric(Recorder& recorder, std::size_t num_sources,
                               const PhotometricParams& params, const DetailBuffers& detail,
                               const Buffer& projections, const Buffer& inverse_depth,
                               const Buffer& measurements) {
  const Kernel& kernel = photometric_.With({static_cast<std::uint32_t>(num_sources / 2)});
  recorder.Dispatch(
      kernel,
      {detail.reference, detail.before, detail.after, projections, inverse_depth, measurements},
      params,
      GridOf(kernel, params.width_px + 2 * kMeasurementBorder,
             DivideRoundingUp(params.height_px + 2 * kMeasurementBorder, kPhotometricRows)));
}

void DepthKernels::Surface(Recorder& recorder, bool with_confidence, const SurfaceParams& params,
                           const Buffer& measurements, const Buffer& uniqueness,
                           const EstimateBuffers& estimates) {
  const Kernel& kernel = surface_.With({with_confidence ? 1u : 0u});
  recorder.Dispatch(
      kernel, {measurements, uniqueness, estimates.inverse_depth, estimates.confidence}, params,
      GridOf(kernel, DivideRoundingUp(params.width_px, kSurfaceColumnsAndRows),
             DivideRoundingUp(params.height_px, kSurfaceColumnsAndRows)));
}

void DepthKernels::Dog(Recorder& recorder, const Buffer& images, LevelSize size,
                       const Buffer& response) {
  const Kernel& kernel = dog_.With();
  recorder.Dispatch(kernel, {images, response}, DogParams{size.width_px, size.height_px},
                    GridOf(kernel, size.groups_per_row(), size.height_px));
}

void DepthKernels::TextureFilter(Recorder& recorder, const TextureFilterParams& params,
                                 const Buffer& response, const EstimateBuffers& estimates,
                                 const Buffer& depth, const Buffer& confidence) {
  const Kernel& kernel = texture_filter_.With({HasWholeTexels(params.width_px)});
  recorder.Dispatch(kernel,
                    {response, estimates.inverse_depth, estimates.confidence, depth, confidence},
                    params, GridOf(kernel, GroupsOfFour(params.width_px), params.height_px));
}

void DepthKernels::InferenceData(Recorder& recorder, LevelSize size,
                                 const EstimateBuffers& estimates, const Buffer& depth,
                                 const Buffer& halved, const Buffer& cells, const Buffer& data,
                                 const Buffer& inverse_depth) {
  const Kernel& kernel = inference_data_.With();
  const LevelSize half = size.Halved();
  recorder.Dispatch(
      kernel,
      {depth, estimates.inverse_depth, estimates.confidence, halved, cells, data, inverse_depth},
      InferenceDataParams{size.width_px, size.height_px},
      GridOf(kernel, half.width_px, half.height_px));
}

void DepthKernels::InferenceHalve(Recorder& recorder, LevelSize size, const Buffer& fine,
                                  const Buffer& coarse) {
  const Kernel& kernel = inference_halve_.With();
  const LevelSize half = size.Halved();
  recorder.Dispatch(kernel, {fine, coarse}, InferenceHalveParams{size.width_px, size.height_px},
                    GridOf(kernel, half.width_px, half.height_px));
}

void DepthKernels::InferenceExpand(Recorder& recorder, LevelSize coarse_size, LevelSize size,
                                   const Buffer& coarse, const Buffer& data, const Buffer& state) {
  const Kernel& kernel = inference_expand_.With();
  recorder.Dispatch(kernel, {coarse, data, state},
                    InferenceExpandParams{coarse_size.width_px, coarse_size.height_px,
                                          size.width_px, size.height_px},
                    GridOf(kernel, size.width_px, size.height_px));
}

void DepthKernels::InferenceRelax(Recorder& recorder, LevelSize size, float leak,
                                  const Buffer& data, const Buffer& before, const Buffer& after) {
  const Kernel& kernel = inference_relax_.With();
  recorder.Dispatch(kernel, {data, before, after},
                    InferenceRelaxParams{size.width_px, size.height_px, leak},
                    GridOf(kernel, size.width_px, size.height_px));
}

void DepthKernels::Inference(Recorder& recorder, std::size_t num_sources,
                             const InferenceParams& params, const TileList& tiles,
                             const Buffer& depth, const Buffer& winners, const Buffer& state,
                             const Buffer& images, const Buffer& cells, const Buffer& projections,
                             const EstimateBuffers& inferred) {
  const Kernel& kernel = inference_.With({static_cast<std::uint32_t>(num_sources / 2)});
  const auto [columns, rows] = GridOfTiles(tiles.num_tiles);
  recorder.Dispatch(kernel,
                    {depth, winners, state, images, cells, projections, tiles.words,
                     inferred.inverse_depth, inferred.confidence},
                    params, {columns, rows, kInferenceRowGroups});
}

void DepthKernels::InferenceNormals(Recorder& recorder, const NormalsParams& params,
                                    const TileList& tiles, const Buffer& inverse_depth,
                                    const Buffer& normals) {
  const Kernel& kernel = inference_normals_.With({HasWholeTexels(params.width_px)});
  const auto [columns, rows] = GridOfTiles(tiles.num_tiles);
  recorder.Dispatch(kernel, {tiles.words, inverse_depth, normals}, params, {columns, rows, 1});
}

}  // namespace mono3d
