// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/scaling_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "geometry/geometry_state.h"
#include "image/state_archive.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d::tracking {
namespace {

constexpr const char* kScalingState = "state of a tracker of scaled images";
constexpr std::uint32_t kScalingVersion = 1;

std::size_t NumFrameBytes(const cv::Mat& image) { return image.total() * image.elemSize(); }

}  // namespace

void KeptImages::Add(std::int64_t index, const cv::Mat& image) {
  Remove(index);
  images_.emplace(index, image);
  num_bytes_ += NumFrameBytes(image);
  while (num_bytes_ > max_bytes_) Remove(images_.begin()->first);
}

void KeptImages::Remove(std::int64_t index) { Take(index); }

std::optional<cv::Mat> KeptImages::Take(std::int64_t index) {
  const auto kept = images_.find(index);
  if (kept == images_.end()) return std::nullopt;
  cv::Mat image = std::move(kept->second);
  images_.erase(kept);
  num_bytes_ -= NumFrameBytes(image);
  return image;
}

ScalingTracker::ScalingTracker(std::unique_ptr<Tracker> tracker, int max_side_px,
                               std::size_t max_kept_bytes)
    : tracker_(std::move(tracker)), max_side_px_(max_side_px), images_(max_kept_bytes) {}

bool ScalingTracker::IsLarge(const CameraModel& camera) const {
  return std::max(camera.width, camera.height) > max_side_px_;
}

Frame ScalingTracker::Scaled(const Frame& frame) const {
  const double scale =
      static_cast<double>(max_side_px_) / std::max(frame.camera.width, frame.camera.height);
  const auto scaled = [&](int length) {
    return std::max(1, static_cast<int>(std::lround(scale * length)));
  };
  Frame small = frame;
  small.camera = frame.camera.Resized(scaled(frame.camera.width), scaled(frame.camera.height));
  if (frame.sensor.width > 0) {
    small.sensor = frame.sensor.Resized(small.camera.width, small.camera.height);
  }
  // Averaging over areas keeps a smaller image free of aliasing.
  cv::resize(frame.bgr, small.bgr, cv::Size(small.camera.width, small.camera.height), 0, 0,
             cv::INTER_AREA);
  return small;
}

TrackingResult ScalingTracker::Track(const Frame& frame) {
  Validate(frame);
  if (!IsLarge(frame.camera)) return tracker_->Track(frame);
  const Frame small = Scaled(frame);
  TrackingResult result = tracker_->Track(small);
  camera_ = frame.camera;
  sensor_ = frame.sensor;
  if (!result.T_world_cam || result.is_keyframe) images_.Add(frame.index, frame.bgr);
  result.reprojection_px *= frame.camera.fx / small.camera.fx;
  GiveImagesBack(result.finalised_keyframes);
  return result;
}

std::vector<Keyframe> ScalingTracker::Finish() {
  std::vector<Keyframe> keyframes = tracker_->Finish();
  GiveImagesBack(keyframes);
  return keyframes;
}

void ScalingTracker::GiveImagesBack(std::vector<Keyframe>& keyframes) {
  if (!camera_) return;
  std::erase_if(keyframes, [&](Keyframe& keyframe) {
    std::optional<cv::Mat> image = images_.Take(keyframe.frame.index);
    if (!image) {
      if (num_without_image_++ == 0) {
        Log(LogLevel::kWarning, keyframe.frame.name +
                                    ": a keyframe whose image is no longer kept is left out; it "
                                    "was too long without a pose");
      }
      return true;
    }
    keyframe.frame.bgr = *std::move(image);
    const float scale =
        static_cast<float>(camera_->width) / static_cast<float>(keyframe.frame.camera.width);
    for (Eigen::Vector2f& pixel : keyframe.sparse_pixels) {
      pixel = scale * (pixel.array() + 0.5F) - 0.5F;
    }
    keyframe.frame.camera = *camera_;
    keyframe.frame.sensor = sensor_;
    return false;
  });
}

template <typename Archive>
void ScalingTracker::ExchangeState(Archive& archive) {
  archive.Optional(camera_, [&](CameraModel& camera) { mono3d::ExchangeState(archive, camera); });
  mono3d::ExchangeState(archive, sensor_);
  ExchangeCount(archive, num_without_image_);
  images_.ExchangeState(archive, camera_.value_or(CameraModel()));
}

std::string ScalingTracker::SaveState(SavedImages images) const {
  StateWriter writer(kScalingState, kScalingVersion, images);
  const_cast<ScalingTracker&>(*this).ExchangeState(writer);  // a writer changes nothing
  std::string state = tracker_->SaveState(images);
  writer.TakeFramesOf(state, kScalingState);
  return state.insert(0, writer.TakeState());
}

void ScalingTracker::RestoreState(std::string_view bytes, const std::string& where,
                                  const ImageOfFrame& images) {
  if (camera_) throw UsageError("a state must be restored before the first frame");
  StateReader reader(bytes, kScalingState, kScalingVersion, where, images);
  ExchangeState(reader);
  if (camera_) Validate(*camera_, where);
  if (sensor_.width != 0) Validate(sensor_, where);
  const auto scaled = [&](std::int64_t index) -> cv::Mat {
    Frame frame;
    frame.index = index;
    frame.bgr = images(index);
    if (!camera_ || frame.bgr.type() != CV_8UC3) return frame.bgr;
    frame.camera = *camera_;
    return Scaled(frame).bgr;
  };
  tracker_->RestoreState(reader.Rest(), where, images ? ImageOfFrame(scaled) : ImageOfFrame());
}

SparseModel ScalingTracker::Sparse(int map_id) const {
  SparseModel sparse = tracker_->Sparse(map_id);
  return camera_ ? WithCamera(sparse, *camera_) : sparse;
}

}  // namespace mono3d::tracking
