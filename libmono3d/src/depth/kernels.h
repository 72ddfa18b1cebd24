// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "depth/detail.params.h"
#include "depth/fine_sweep.params.h"
#include "depth/fine_winner.params.h"
#include "depth/inference.params.h"
#include "depth/kernel_variants.h"
#include "depth/median.params.h"
#include "depth/normals.params.h"
#include "depth/padded_image.h"
#include "depth/photometric.params.h"
#include "depth/plane_sweep.params.h"
#include "depth/prior.params.h"
#include "depth/sgm.h"
#include "depth/surface.params.h"
#include "depth/texture_filter.params.h"
#include "depth/upsample.params.h"
#include "depth/winner_takes_all.params.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// An estimate of each pixel, floats in rows without padding.
struct EstimateBuffers {
  const Buffer& inverse_depth;  // 1/su; 0: no estimate
  const Buffer& confidence;     // 0 to 1; of winners their uniqueness
};

// Which images lie on either side of the reference: how many, and how their costs are combined.
struct SweepSources {
  std::size_t num_sources = 0;
  int side_tolerance = 0;  // PlaneSweepOptions::side_tolerance
};

// What the stages of a level below the coarsest pass on, in the order of fine_volume.h.
struct FineVolumes {
  const Buffer& ranges;      // two words a pixel
  const Buffer& costs;       // kFinePlanes bytes a pixel
  const Buffer& paths;       // path costs of four directions, each as large as `costs`
  const Buffer& more_paths;  // of the other four; bound, but not read or written, without them
};

// Detail of the reference, of the sources before it and of those after it: of all in one buffer
// there would be too much to bind at 3840x2160.
struct DetailBuffers {
  const Buffer& reference;
  const Buffer& before;
  const Buffer& after;
};

// Tiles of a map (depth/inference_tiles.h), as WordsOfTiles has them.
struct TileList {
  const Buffer& words;
  std::size_t num_tiles = 0;
};

// The kernels of the depth stage; each method records one. What it does, and the shape and unit of
// its buffers, stands in its shader, shaders/depth/<stage>.comp. "Images" are padded grey images
// one after the other, the reference first (padded_image.h). One thread at a time.
class DepthKernels {
 public:
  explicit DepthKernels(const std::shared_ptr<Device>& device);

  // Makes what bundles of kBundleSize need with these options; otherwise each kernel is made when
  // it is first recorded. About 0.6 s of processor time on lavapipe.
  void Prepare(const DepthEstimatorOptions& options);

  // Halves `num_images` images of `size`.
  void Pyramid(Recorder& recorder, const Buffer& fine, LevelSize size, std::uint32_t num_images,
               const Buffer& coarse);

  // The coarsest level.

  // Two words for each of size.num_strided_pixels() pixels of each image. `quarter_turns`:
  // PackQuarterTurns.
  void Census(Recorder& recorder, const Buffer& images, LevelSize size, std::uint32_t num_images,
              std::uint32_t quarter_turns, const Buffer& census);
  // params.padded_planes bytes a pixel.
  void PlaneSweep(Recorder& recorder, const SweepSources& sources, const PlaneSweepParams& params,
                  const Buffer& census, const Buffer& projections, const Buffer& costs);
  // A 16-bit sum for each cost.
  void Sgm(Recorder& recorder, LevelSize size, std::uint32_t padded_planes,
           const SgmPenalties& penalties, const Buffer& images, const Buffer& costs,
           const Buffer& sums);
  // The least number of planes that holds `num_planes` and is spread over the lanes of a subgroup
  // in whole words: `padded_planes` of the stages of this level.
  std::uint32_t PaddedPlanes(std::uint32_t num_planes) const;
  // Without `sub_plane` the depth is that of the plane itself.
  void WinnerTakesAll(Recorder& recorder, bool sub_plane, const WinnerTakesAllParams& params,
                      const Buffer& sums, const Buffer& costs, const EstimateBuffers& winners);

  // A level below it.

  // The planes that each pixel is matched on: writes volumes.ranges.
  void Prior(Recorder& recorder, const PriorParams& params, const Buffer& coarse_depth,
             const Buffer& coarse_normals, const Buffer& images, const FineVolumes& volumes);
  // NumFineCensusTexels of each image.
  void FineCensus(Recorder& recorder, const Buffer& images, LevelSize size,
                  std::uint32_t num_images, std::uint32_t quarter_turns, const Buffer& census);
  // Reads volumes.ranges, writes volumes.costs.
  void FineSweep(Recorder& recorder, const SweepSources& sources, const FineSweepParams& params,
                 const Buffer& census, const Buffer& projections, const FineVolumes& volumes);
  // The first `num_paths` directions, kFewPaths or kNumPaths: reads volumes.ranges and costs,
  // writes the paths of all but the last of them. That one writes the winners; without `sub_plane`
  // their depth is that of the plane itself.
  void FineSgm(Recorder& recorder, const SgmPenalties& penalties, std::uint32_t num_paths,
               bool sub_plane, const FineWinnerParams& params, const FineVolumes& volumes,
               const EstimateBuffers& winners);
  // A path alone: direction `path` of kPathDirections, to the paths.
  void FinePath(Recorder& recorder, LevelSize size, const SgmPenalties& penalties,
                std::uint32_t path, const FineVolumes& volumes);

  // Every level.

  // Without `with_confidence` to.confidence is not written.
  void Median(Recorder& recorder, bool with_confidence, const MedianParams& params,
              const EstimateBuffers& from, const EstimateBuffers& to);
  // Three floats a pixel.
  void Normals(Recorder& recorder, const NormalsParams& params, const Buffer& inverse_depth,
               const Buffer& normals);

  // Full resolution.

  void Upsample(Recorder& recorder, const UpsampleParams& params, const EstimateBuffers& coarse,
                const EstimateBuffers& fine);
  // High-pass values of `num_images` images from params.first_image on, a word for each strided
  // pixel. `quarter` holds the images halved twice.
  void Detail(Recorder& recorder, const DetailParams& params, std::uint32_t num_images,
              const Buffer& images, const Buffer& quarter, const Buffer& gains,
              const Buffer& detail);
  // Two words for each of NumMeasurements.
  void Photometric(Recorder& recorder, std::size_t num_sources, const PhotometricParams& params,
                   const DetailBuffers& detail, const Buffer& projections,
                   const Buffer& inverse_depth, const Buffer& measurements);
  // `measurements` is that of Photometric. Without `with_confidence` that of `estimates` is not
  // written.
  void Surface(Recorder& recorder, bool with_confidence, const SurfaceParams& params,
               const Buffer& measurements, const Buffer& uniqueness,
               const EstimateBuffers& estimates);
  // Of the first image. A word for each strided pixel.
  void Dog(Recorder& recorder, const Buffer& images, LevelSize size, const Buffer& response);
  // `depth` gets z-depth, su.
  void TextureFilter(Recorder& recorder, const TextureFilterParams& params, const Buffer& response,
                     const EstimateBuffers& estimates, const Buffer& depth,
                     const Buffer& confidence);

  // Surfaces that were not matched. Data and states are maps of four floats a pixel.

  // `depth` is that of TextureFilter, `halved` images of half the resolution, `cells` texels of
  // the cells of 4x4 pixels. `inverse_depth` gets that of `depth`.
  void InferenceData(Recorder& recorder, LevelSize size, const EstimateBuffers& estimates,
                     const Buffer& depth, const Buffer& halved, const Buffer& cells,
                     const Buffer& data, const Buffer& inverse_depth);
  void InferenceHalve(Recorder& recorder, LevelSize size, const Buffer& fine, const Buffer& coarse);
  void InferenceExpand(Recorder& recorder, LevelSize coarse_size, LevelSize size,
                       const Buffer& coarse, const Buffer& data, const Buffer& state);
  void InferenceRelax(Recorder& recorder, LevelSize size, float leak, const Buffer& data,
                      const Buffer& before, const Buffer& after);
  // Writes those pixels of the tiles at which something is inferred.
  void Inference(Recorder& recorder, std::size_t num_sources, const InferenceParams& params,
                 const TileList& tiles, const Buffer& depth, const Buffer& winners,
                 const Buffer& state, const Buffer& images, const Buffer& cells,
                 const Buffer& projections, const EstimateBuffers& inferred);
  // As Normals, of the pixels of the tiles.
  void InferenceNormals(Recorder& recorder, const NormalsParams& params, const TileList& tiles,
                        const Buffer& inverse_depth, const Buffer& normals);

 private:
  std::uint32_t num_lanes_;  // of a subgroup
  KernelVariants pyramid_;
  KernelVariants census_;
  KernelVariants plane_sweep_;
  KernelVariants sgm_;
  KernelVariants winner_takes_all_;
  KernelVariants prior_;
  KernelVariants fine_census_;
  KernelVariants fine_sweep_;
  KernelVariants fine_sgm_;
  KernelVariants median_;
  KernelVariants normals_;
  KernelVariants upsample_;
  KernelVariants detail_;
  KernelVariants photometric_;
  KernelVariants surface_;
  KernelVariants dog_;
  KernelVariants texture_filter_;
  KernelVariants inference_data_;
  KernelVariants inference_halve_;
  KernelVariants inference_expand_;
  KernelVariants inference_relax_;
  KernelVariants inference_;
  KernelVariants inference_normals_;
};

}  // namespace mono3d
