// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

enum class FusionStatus { kFused, kRejected };

// What became of one depth map.
struct FusionResult {
  FusionStatus status = FusionStatus::kRejected;
  std::string reason;             // why it was rejected; the model is then as it was
  Pose T_world_cam;               // the pose at which it was fused
  double scale = 1;               // by which its depths were multiplied
  std::int64_t num_merged = 0;    // pixels that confirmed a surfel
  std::int64_t num_inserted = 0;  // pixels that became a new surfel
  std::int64_t num_removed = 0;   // surfels that stood in free space
  std::int64_t num_surfels = 0;   // in the model afterwards
};

// The coloured surfel model of the scene (paper, section 3.3).
class SurfelMap {
 public:
  virtual ~SurfelMap() = default;

  // Throws Error on an invalid depth map.
  [[nodiscard]] virtual FusionResult Integrate(const DepthMap& map) = 0;

  // The surfels that at least `min_observations` depth maps agree on, in a reproducible order.
  virtual PointCloud Export(int min_observations) const = 0;

  virtual std::int64_t num_surfels() const = 0;
};

struct SurfelMapOptions {
  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// `times`, where given, must outlive the map.
std::unique_ptr<SurfelMap> CreateSurfelMap(std::shared_ptr<Device> device,
                                           const SurfelMapOptions& options = {},
                                           StageTimes* times = nullptr);

}  // namespace mono3d
