// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>

#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

enum class DepthStatus { kEstimated, kRejected };

struct DepthResult {
  DepthStatus status = DepthStatus::kRejected;
  std::string reason;       // why there is no depth: "no baseline between the images"
  DepthMap map;             // empty images when rejected
  int num_planes = 0;       // of the sweep on the coarsest level
  double min_depth_su = 0;  // range of the sweep
  double max_depth_su = 0;
};

// Depth of the middle image of a bundle (paper, section 3.2).
class DepthEstimator {
 public:
  virtual ~DepthEstimator() = default;

  // Throws Error on an invalid bundle; a bundle without depth in it is a status.
  [[nodiscard]] virtual DepthResult Estimate(const ImageBundle& bundle) = 0;
};

struct PlaneSweepOptions {
  double min_depth_su = 0;  // 0: from the sparse points, else from the baseline
  double max_depth_su = 0;

  void Visit(OptionVisitor& visit);
};

struct SgmOptions {
  int p1 = 0;
  int p2 = 0;

  void Visit(OptionVisitor& visit);
};

struct DepthEstimatorOptions {
  PlaneSweepOptions plane_sweep;
  SgmOptions sgm;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Plane sweep and semi-global matching on `device`. `times`, where given, must outlive it.
std::unique_ptr<DepthEstimator> CreateDepthEstimator(std::shared_ptr<Device> device,
                                                     const DepthEstimatorOptions& options = {},
                                                     StageTimes* times = nullptr);

}  // namespace mono3d
