// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

// A depth map, and where the tracker has its keyframe when it comes: the own unit of the keyframe
// is that of the world then.
struct TrackedMap : DepthMap {
  int map_id = 0;
  Pose T_world_cam;
};

// A model and the tracker whose poses it gets. A depth map whose keyframe has the number 0 gets
// another one when there is a keyframe 0 already.
class TrackedModel {
 public:
  explicit TrackedModel(std::unique_ptr<SurfelMap> model) : model_(std::move(model)) {}

  FusionResult Integrate(const TrackedMap& map);
  // The tracker has moved these keyframes; the others stay.
  UpdateResult Update(std::span<const KeyframePose> moved);
  std::optional<UpdateResult> Join(TrackedModel& other, std::span<const KeyframePose> moved);
  KeyframePoses Poses() const;

  SurfelMap& model() { return *model_; }
  void Rest() { model_->Rest(); }
  PointCloud Export(const SurfelExportOptions& options) const { return model_->Export(options); }
  PointCloud Export(int min_observations) const { return model_->Export(min_observations); }
  std::vector<FusedDepthMap> DepthMaps() const { return model_->DepthMaps(); }
  std::int64_t num_surfels() const { return model_->num_surfels(); }

 private:
  std::unique_ptr<SurfelMap> model_;
  std::map<std::int64_t, KeyframePose> poses_;
};

std::unique_ptr<TrackedModel> CreateTrackedModel(const SurfelMapOptions& options = {},
                                                 StageTimes* times = nullptr);

}  // namespace mono3d
