// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <deque>
#include <memory>

#include "depth/kernels.h"
#include "depth/sgm.h"
#include "depth/sweep_geometry.h"
#include "depth/sweep_plan.h"
#include "depth/winner_selection.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// A level below the coarsest: from the images of the level and the depth of the next coarser one to
// the inverse depth of the reference on the level by normals of the coarse depth, a choice of
// planes around it, census, plane sweep, SGM^sn, winner takes all and median. Keeps its buffers
// from one level and bundle to the next.
class FineLevel {
 public:
  // `kernels` must outlive it.
  FineLevel(std::shared_ptr<Device> device, DepthKernels& kernels,
            const DepthEstimatorOptions& options);

  struct Level {
    CameraModel coarse_camera;
    SweepPlan plan;        // of this level
    bool is_last = false;  // of the hierarchy: the others keep every winner, as a prior
  };

  // Bytes of the largest buffer of a level.
  static std::uint64_t LargestBufferBytes(LevelSize size, std::size_t num_sources);

  // `images` holds padded images of plan.size, the reference first; `coarse_depth` inverse
  // depth of the coarser level. The results are there after recorder.Submit(),
  // plan.size.num_pixels() floats each.
  void Record(Recorder& recorder, const Level& level, const SourceProjections& projections,
              const Buffer& images, const Buffer& coarse_depth);

  // Of a level that was recorded.
  const WinnerSelection& results(int level) const {
    return winner_selections_[static_cast<std::size_t>(level)];
  }

 private:
  void RecordPrior(Recorder& recorder, const Level& level, const Buffer& images,
                   const Buffer& coarse_depth);
  void RecordSweep(Recorder& recorder, const Level& level, const SourceProjections& projections,
                   const Buffer& images);
  std::uint32_t NumPaths(const Level& level) const;
  FineVolumes volumes() const { return {ranges_, costs_, paths_, more_paths_}; }
  WinnerSelection& SelectionOf(int level);
  void RecordWinnerSelection(Recorder& recorder, const Level& level);

  std::shared_ptr<Device> device_;
  DepthKernels& kernels_;
  DepthEstimatorOptions options_;
  SgmPenalties penalties_;
  std::deque<WinnerSelection> winner_selections_;  // by level
  std::vector<Buffer> projections_;                // by level: all are read at Submit
  Buffer coarse_normals_;
  Buffer ranges_;
  Buffer census_;
  Buffer costs_;
  Buffer paths_;
  Buffer more_paths_;
};

}  // namespace mono3d
