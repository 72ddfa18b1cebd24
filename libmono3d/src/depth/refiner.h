// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>

#include "depth/kernels.h"
#include "depth/sweep_geometry.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// Refines the depth of the sweep to fractions of a plane at full resolution, by alternating a
// photometric Gauss-Newton step of each pixel and a fit of the surface around it. Keeps its buffers
// from one bundle to the next.
class Refiner {
 public:
  // `kernels` must outlive it.
  Refiner(std::shared_ptr<Device> device, DepthKernels& kernels, const RefinementOptions& options);

  // From the next Record on; 0: there is none.
  void SetIterations(int iterations) { options_.iterations = iterations; }

  struct Input {
    const Buffer& images;   // padded images, the reference first
    const Buffer& quarter;  // the same, halved twice
    const Buffer& gains;    // of their contrasts, a uint each, see contrast.h
    const Buffer& inverse_depth;
    const Buffer& uniqueness;  // of the sweep, 0 to 1
    double step = 0;           // of inverse depth for 1 px in the farthest camera, 1/su
    double noise = 0;          // standard deviation of the grey values
  };

  // The results are there after recorder.Submit().
  void Record(Recorder& recorder, const SweepGeometry& geometry, const Input& input);

  const Buffer& inverse_depth() const { return inverse_depth_; }  // 1/su; 0: no estimate
  const Buffer& confidence() const { return confidence_; }        // 0 to 1

 private:
  void RecordDetail(Recorder& recorder, const LevelSize& size, std::uint32_t first_image,
                    std::uint32_t num_images, const Input& input, Buffer& detail);

  std::shared_ptr<Device> device_;
  DepthKernels& kernels_;
  RefinementOptions options_;
  Buffer projections_;
  Buffer reference_detail_;
  Buffer detail_before_;  // of the sources before the reference
  Buffer detail_after_;
  Buffer measurements_;
  Buffer inverse_depth_;
  Buffer confidence_;
};

}  // namespace mono3d
