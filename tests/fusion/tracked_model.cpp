// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/tracked_model.h"

#include <utility>

#include "gpu/test_device.h"

namespace mono3d {

FusionResult TrackedModel::Integrate(const TrackedMap& map) {
  DepthMap numbered = map;
  if (map.keyframe_id == 0 && poses_.contains(0)) {
    numbered.keyframe_id = poses_.rbegin()->first + 1;
  }
  poses_[numbered.keyframe_id] = {numbered.keyframe_id, map.map_id, Similarity(1, map.T_world_cam)};
  return model_->Integrate(numbered, Poses());
}

UpdateResult TrackedModel::Update(std::span<const KeyframePose> moved) {
  for (const KeyframePose& pose : moved) poses_[pose.keyframe_id] = pose;
  return model_->Update(Poses());
}

std::optional<UpdateResult> TrackedModel::Join(TrackedModel& other,
                                               std::span<const KeyframePose> moved) {
  std::map<std::int64_t, KeyframePose> joined = other.poses_;
  joined.insert(poses_.begin(), poses_.end());
  for (const KeyframePose& pose : moved) joined[pose.keyframe_id] = pose;
  std::swap(poses_, joined);
  auto result = model_->Join(*other.model_, Poses());
  if (!result) std::swap(poses_, joined);
  return result;
}

KeyframePoses TrackedModel::Poses() const {
  std::vector<KeyframePose> poses;
  for (const auto& [id, pose] : poses_) poses.push_back(pose);
  return {1, std::move(poses)};
}

std::unique_ptr<TrackedModel> CreateTrackedModel(const SurfelMapOptions& options,
                                                 StageTimes* times) {
  return std::make_unique<TrackedModel>(CreateSurfelMap(TestDevice(), options, times));
}

}  // namespace mono3d
