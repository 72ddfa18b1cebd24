// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/adopted_files.h"

#include <utility>

namespace mono3d::tools {

void AdoptedFiles::Run::WriteDepthMap(const DepthMap& map) {
  {
    const std::lock_guard lock(mutex_);
    depth_maps_.insert(map.frame_index);
  }
  writer_.WriteDepthMap(map);
}

void AdoptedFiles::Run::WriteKeyframeImage(const Frame& frame) {
  {
    const std::lock_guard lock(mutex_);
    keyframe_images_.insert(frame.name);
  }
  writer_.WriteKeyframeImage(frame);
}

std::shared_ptr<AdoptedFiles::Run> AdoptedFiles::BeginRun() {
  before_ = std::exchange(latest_, std::make_shared<Run>(writer_));
  return latest_;
}

void AdoptedFiles::RemoveBefore() {
  const std::lock_guard lock(latest_->mutex_);
  for (const std::int64_t frame_index : before_->depth_maps_) {
    if (!latest_->depth_maps_.contains(frame_index)) writer_.RemoveDepthMap(frame_index);
  }
  for (const std::string& name : before_->keyframe_images_) {
    if (!latest_->keyframe_images_.contains(name)) writer_.RemoveKeyframeImage(name);
  }
}

}  // namespace mono3d::tools
