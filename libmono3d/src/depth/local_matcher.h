// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/choice.h"
#include "depth/local_census.h"
#include "depth/local_sgm.h"
#include "depth/local_sweep.h"
#include "depth/local_winner.h"
#include "depth/normals.h"
#include "depth/prior.h"
#include "depth/sweep_plan.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// A level below the coarsest: from images of the level and the depth of the next coarser one to the
// inverse depth of the reference on the level. Normals of the coarse depth, planes around it,
// census, plane sweep, SGM^sn, winner takes all, median. Keeps its buffers from one level and
// bundle to the next.
class LocalMatcher {
 public:
  LocalMatcher(std::shared_ptr<Device> device, const DepthEstimatorOptions& options);

  struct Level {
    CameraModel coarse_camera;
    SweepPlan plan;        // of this level
    bool is_last = false;  // of the hierarchy: the others keep every winner, as a prior
  };

  // Bytes of the largest buffer of a level.
  static std::uint64_t LargestBufferBytes(LevelSize size, std::size_t num_sources);

  // `images` holds padded images of plan.size, the reference first; `coarse_depth` inverse
  // depth of the coarser level, which may be inverse_depth() of the level before. The results are
  // there after recorder.Submit(), plan.size.num_pixels() floats each.
  void Record(Recorder& recorder, const Level& level, const SourceProjections& projections,
              const Buffer& images, const Buffer& coarse_depth);

  const Buffer& inverse_depth() const { return choice_.inverse_depth(); }  // 1/su; 0: no estimate
  const Buffer& confidence() const { return choice_.confidence(); }  // of the last level, 0 to 1

 private:
  void RecordPrior(Recorder& recorder, const Level& level, const Buffer& images,
                   const Buffer& coarse_depth);
  void RecordSweep(Recorder& recorder, const Level& level, const SourceProjections& projections,
                   const Buffer& images);
  std::uint32_t NumPaths(const Level& level) const;
  void RecordChoice(Recorder& recorder, const Level& level);

  std::shared_ptr<Device> device_;
  DepthEstimatorOptions options_;
  NormalsStage normals_stage_;
  PriorStage prior_;
  LocalCensusStage local_census_;
  LocalSweepStage sweep_;
  LocalSgmStage sgm_;
  LocalWinnerStage winner_;
  LocalWinnerStage last_winner_;
  Choice choice_;
  std::vector<Buffer> projections_;  // by level: all are read at Submit
  Buffer coarse_normals_;
  Buffer ranges_;
  Buffer census_;
  Buffer costs_;
  Buffer paths_;
  Buffer more_paths_;
};

}  // namespace mono3d
