// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mono3d/tracking/tracker.h"

namespace mono3d::tracking {

// Images by the index of their frame; the oldest go when all together exceed `max_bytes`.
class KeptImages {
 public:
  explicit KeptImages(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void Add(std::int64_t index, const cv::Mat& image);
  void Remove(std::int64_t index);
  // Takes the image out; nothing where it has gone.
  std::optional<cv::Mat> Take(std::int64_t index);
  std::size_t size() const { return images_.size(); }
  // For the archives of image/state_archive.h; of images of this camera.
  template <typename Archive>
  void ExchangeState(Archive& archive, const CameraModel& camera) {
    std::vector<std::pair<std::int64_t, cv::Mat>> images(images_.begin(), images_.end());
    archive.Sections(images, 1, [&](auto& image) {
      archive.Number(image.first);
      archive.Image(image.second, image.first);
    });
    if constexpr (Archive::kReads) {
      for (const auto& [index, image] : images) {
        if (image.type() != CV_8UC3 || image.cols != camera.width || image.rows != camera.height) {
          archive.Refuse("an image has another size than its camera");
        }
        Add(index, image);
      }
    }
  }

 private:
  std::size_t max_bytes_;
  std::size_t num_bytes_ = 0;
  std::map<std::int64_t, cv::Mat> images_;
};

// Tracks large images on smaller ones, whose longer side has `max_side_px` pixels, by another
// tracker. Poses are those of the images given; keyframes have these images, and the sparse model
// is in pixels of their camera. Frames that are small enough pass as they are. A keyframe whose
// image had to go, of a start that took very long, is not handed out, but counted, with a warning
// in the log for the first one.
class ScalingTracker final : public Tracker {
 public:
  // Keeps 1 GB of images, forty of 3840x2160, unless told otherwise.
  ScalingTracker(std::unique_ptr<Tracker> tracker, int max_side_px,
                 std::size_t max_kept_bytes = 1'000'000'000);

  TrackingResult Track(const Frame& frame) override;
  KeyframePosesPtr Poses() const override { return tracker_->Poses(); }
  void WaitForMapping() override { tracker_->WaitForMapping(); }
  void Constrain(std::span<const KeyframeConstraint> constraints) override {
    tracker_->Constrain(constraints);
  }
  void FollowPositions(const CameraPositions& positions) override {
    tracker_->FollowPositions(positions);
  }
  std::vector<PositionFit> PositionFits() const override { return tracker_->PositionFits(); }
  std::vector<Keyframe> Finish() override;
  std::int64_t num_keyframes_without_image() const override { return num_without_image_; }
  std::vector<TrajectoryEntry> Trajectory() const override { return tracker_->Trajectory(); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override {
    return tracker_->KeyframeTrajectory();
  }
  SparseModel Sparse(int map_id) const override;
  std::string SaveMap() const override { return tracker_->SaveMap(); }
  void LoadMap(std::string_view bytes, const std::string& where) override {
    tracker_->LoadMap(bytes, where);
  }
  std::string SaveState(SavedImages images) const override;
  void RestoreState(std::string_view bytes, const std::string& where,
                    const ImageOfFrame& images) override;

 private:
  template <typename Archive>
  void ExchangeState(Archive& archive);
  bool IsLarge(const CameraModel& camera) const;
  Frame Scaled(const Frame& frame) const;
  void GiveImagesBack(std::vector<Keyframe>& keyframes);

  std::unique_ptr<Tracker> tracker_;
  int max_side_px_;
  std::optional<CameraModel> camera_;  // of the images given
  CameraModel sensor_;                 // Frame::sensor of the same
  KeptImages images_;                  // of frames that are or may become keyframes
  std::int64_t num_without_image_ = 0;
};

}  // namespace mono3d::tracking
