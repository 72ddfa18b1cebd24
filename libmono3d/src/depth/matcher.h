// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/census.h"
#include "depth/choice.h"
#include "depth/half_pixel.h"
#include "depth/plane_sweep.h"
#include "depth/sgm.h"
#include "depth/sweep_plan.h"
#include "depth/winner_takes_all.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// From images of one level to the inverse depth of the reference on that level: census, plane
// sweep, SGM, winner takes all, median. Keeps its buffers from one bundle to the next.
class Matcher {
 public:
  Matcher(std::shared_ptr<Device> device, const DepthEstimatorOptions& options);

  std::uint32_t PaddedPlanes(std::uint32_t num_planes) const {
    return sgm_.PaddedPlanes(num_planes);
  }

  // `images` holds padded images of plan.size, the reference and then the sources. The results are
  // there after recorder.Submit(), plan.size.num_pixels() floats each. Every winner is kept, as a
  // prior, unless `is_last`.
  void Record(Recorder& recorder, const SweepPlan& plan, const SourceProjections& projections,
              const Buffer& images, bool is_last);

  const Buffer& inverse_depth() const { return choice_.inverse_depth(); }  // 1/su; 0: no estimate
  const Buffer& confidence() const { return choice_.confidence(); }        // 0 to 1

 private:
  void RecordCensus(Recorder& recorder, const LevelSize& size, std::size_t num_sources,
                    const Buffer& images);
  void RecordSweep(Recorder& recorder, const SweepPlan& plan, const SourceProjections& projections,
                   const Buffer& images);
  void RecordChoice(Recorder& recorder, const SweepPlan& plan, bool is_last);

  std::shared_ptr<Device> device_;
  DepthEstimatorOptions options_;
  HalfPixelStage half_pixel_;
  CensusStage census_stage_;
  PlaneSweepStage plane_sweep_;
  SgmStage sgm_;
  WinnerTakesAllStage winner_takes_all_;
  Choice choice_;
  Buffer shifted_images_;
  Buffer census_;
  Buffer projections_;
  Buffer costs_;
  Buffer sums_;
};

}  // namespace mono3d
