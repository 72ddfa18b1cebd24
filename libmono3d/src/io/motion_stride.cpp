// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/motion_stride.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "io/image_motion.h"

namespace mono3d {
namespace {

// Of the longer side. The tracker makes a keyframe after 4 degrees, or 7 % of the depth, which is 4
// to 6 % of the width with the lenses of drones, and earlier where points go out of view: some five
// images on the shortest of these ways leave it the choice of a sharp one.
constexpr double kMinMotion = 0.005;
// By how much the steps may grow. Who predicts by the motion before expects four times that motion
// then, where the camera has stopped: 2 to 4 % of the image too much, which trackers that begin
// with coarse images make up for.
constexpr std::int64_t kMaxGrowth = 4;

class MotionStride : public ImageSource {
 public:
  MotionStride(std::unique_ptr<ImageSource> source, int max_frames)
      : source_(std::move(source)), max_frames_(max_frames) {}

  std::optional<SourceImage> Next() override {
    if (max_frames_ > 0 && num_taken_ == max_frames_) return std::nullopt;
    for (std::int64_t step = 1;; ++step) {
      std::optional<SourceImage> image = source_->Next();
      if (!image) {
        num_passed_over_ += step - 1;
        return std::nullopt;
      }
      SmallImage small(image->bgr);
      if (step < kMaxGrowth * last_step_ && IsStill(small)) continue;
      taken_.emplace(std::move(small));
      last_step_ = step;
      num_passed_over_ += step - 1;
      ++num_taken_;
      return image;
    }
  }

  std::optional<std::int64_t> num_frames() const override {
    std::optional<std::int64_t> count = source_->num_frames();
    if (count && max_frames_ > 0) count = std::min<std::int64_t>(*count, max_frames_);
    return count;
  }
  std::int64_t num_skipped() const override { return source_->num_skipped(); }
  std::int64_t num_passed_over() const override { return num_passed_over_; }

 private:
  bool IsStill(const SmallImage& image) const {
    if (!taken_) return false;
    const std::optional<double> motion = taken_->To(image);
    return motion && *motion < kMinMotion;
  }

  std::unique_ptr<ImageSource> source_;
  int max_frames_;
  std::optional<ImageMotion> taken_;  // the image that was taken last
  std::int64_t last_step_ = 1;        // images that this was behind the one taken before
  std::int64_t num_taken_ = 0;
  std::int64_t num_passed_over_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> StrideByMotion(std::unique_ptr<ImageSource> source, int max_frames) {
  return std::make_unique<MotionStride>(std::move(source), max_frames);
}

}  // namespace mono3d
