// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/adopted_files.h"

#include <utility>

#include "common/state_json.h"

namespace mono3d::tools {

void AdoptedFiles::Run::WriteDepthMap(const DepthMap& map) {
  thread_.Add([this, map] {
    const ScopedStageTimer timer(&context_.times, "io/write_depth_map");
    context_.failures.Try("depth maps", [&] { Write(map); });
  });
}

void AdoptedFiles::Run::Write(const DepthMap& map) {
  {
    const std::lock_guard lock(mutex_);
    depth_maps_.insert(map.frame_index);
    if (!depth_camera_) {
      depth_camera_ = map.camera;
      context_.writer.WriteDepthCamera(map.camera);
    }
  }
  context_.writer.WriteDepthMap(map);
}

void AdoptedFiles::Run::WriteKeyframeImage(const Frame& frame) {
  const ScopedStageTimer timer(&context_.times, "io/write_global_shutter_image");
  {
    const std::lock_guard lock(mutex_);
    keyframe_images_.insert(frame.name);
  }
  context_.failures.Try("keyframe images", [&] { context_.writer.WriteKeyframeImage(frame); });
}

nlohmann::json AdoptedFiles::Run::ToJson() const {
  Wait();
  const std::lock_guard lock(mutex_);
  nlohmann::json json = {{"depth_maps", depth_maps_}, {"keyframe_images", keyframe_images_}};
  if (depth_camera_) json["depth_camera"] = CameraToJson(*depth_camera_);
  return json;
}

void AdoptedFiles::Run::TakeJson(const nlohmann::json& json) {
  const std::lock_guard lock(mutex_);
  json.at("depth_maps").get_to(depth_maps_);
  json.at("keyframe_images").get_to(keyframe_images_);
  depth_camera_.reset();
  if (json.contains("depth_camera")) depth_camera_ = CameraFromJson(json.at("depth_camera"));
}

void AdoptedFiles::Run::RemoveOtherDepthMaps(std::int64_t last_frame) const {
  const std::lock_guard lock(mutex_);
  for (std::int64_t index = 0; index <= last_frame; ++index) {
    if (!depth_maps_.contains(index)) context_.writer.RemoveDepthMap(index);
  }
}

std::shared_ptr<AdoptedFiles::Run> AdoptedFiles::BeginRun() {
  before_ = std::exchange(latest_, std::make_shared<Run>(context_));
  return latest_;
}

void AdoptedFiles::RemoveBefore() {
  before_->Wait();
  const std::lock_guard lock(latest_->mutex_);
  for (const std::int64_t frame_index : before_->depth_maps_) {
    if (!latest_->depth_maps_.contains(frame_index)) context_.writer.RemoveDepthMap(frame_index);
  }
  for (const std::string& name : before_->keyframe_images_) {
    if (!latest_->keyframe_images_.contains(name)) context_.writer.RemoveKeyframeImage(name);
  }
}

std::optional<CameraModel> AdoptedFiles::DepthCamera() const {
  for (const std::shared_ptr<Run>& run : {latest_, before_}) {
    if (run == nullptr) continue;
    const std::lock_guard lock(run->mutex_);
    if (run->depth_camera_) return run->depth_camera_;
  }
  return std::nullopt;
}

}  // namespace mono3d::tools
