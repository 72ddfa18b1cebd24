// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "depth/coarse_level.h"
#include "depth/fine_level.h"
#include "depth/grey_images.h"
#include "depth/kernels.h"
#include "depth/sweep_geometry.h"
#include "depth/sweep_plan.h"
#include "depth/winner_selection.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/core/timing.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

// Coarse to fine (paper, section 3.2): image pyramid, plane sweep over the whole range of depths on
// the coarsest level, planes around the depth of the level above on each finer one. Keeps its
// buffers from one bundle to the next.
class Hierarchy {
 public:
  // `kernels` must outlive it.
  Hierarchy(std::shared_ptr<Device> device, DepthKernels& kernels,
            const DepthEstimatorOptions& options);

  // First of all: the images that the rest is about. `greys` are those of the bundle.
  void Upload(const ImageBundle& bundle, const GreyImages& greys);

  // Of the options, else of the reference's sparse points, else of the other images' points, which
  // see much the same scene from nearly as far; else of a sweep, which is submitted. Empty when
  // the images do not overlap or do not match.
  std::optional<InverseDepthRange> FindRange(Recorder& recorder, const ImageBundle& bundle,
                                             const SweepGeometry& geometry, StageTimes* times);

  // Returns the plan of the finest level. The results are there after recorder.Submit().
  SweepPlan Record(Recorder& recorder, const SweepGeometry& geometry,
                   const InverseDepthRange& range);

  struct LevelResults {
    SweepPlan plan;
    const WinnerSelection* selection = nullptr;
  };

  // Of the finest level: inverse depth in 1/su, 0: no estimate; confidence 0 to 1.
  const Buffer& inverse_depth() const { return finest().inverse_depth(); }
  const Buffer& confidence() const { return finest().confidence(); }
  // Inverse depth before the median, 1/su; 0 or less: no estimate.
  const Buffer& winners() const { return finest().winners().inverse_depth; }
  // Of all levels, the coarsest one first.
  std::span<const LevelResults> results() const { return results_; }
  // Padded images of a level up to kDetailLevel, the reference and then the sources.
  const Buffer& images(int level) const { return levels_[static_cast<std::size_t>(level)]; }

  // A uint per image, in kGainSteps: what its contrast is to be multiplied by to be the
  // reference's.
  const Buffer& contrast_gains() const { return contrast_gains_; }

  // detail.comp takes away the images of this level.
  static constexpr int kDetailLevel = 2;

 private:
  void RecordPyramid(Recorder& recorder, const LevelSize& full, int level);
  std::optional<InverseDepthRange> SearchRange(Recorder& recorder, const SweepGeometry& geometry,
                                               StageTimes* times);
  SweepLimits LimitsFrom(int level) const;
  int FinestLevel(const CameraModel& camera) const;  // of the images that were uploaded
  int CoarsestLevel(const CameraModel& camera, int finest) const;
  const WinnerSelection& finest() const { return *results_.back().selection; }

  std::shared_ptr<Device> device_;
  DepthKernels& kernels_;
  DepthEstimatorOptions options_;
  CoarseLevel coarse_level_;
  FineLevel fine_level_;
  std::size_t num_images_ = 0;
  std::vector<Buffer> levels_;
  Buffer contrast_gains_;
  std::vector<LevelResults> results_;
};

}  // namespace mono3d
