// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/image_list.h"
#include "io/image_source.h"
#include "mono3d/core/error.h"
#include "mono3d/image/common_camera.h"
#include "mono3d/image/undistorter.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

// Bilinear interpolation reads two pixels of a row: with larger steps it passes some over, and
// what is finer than the new pixels turns into false detail.
constexpr double kMaxStep_px = 1.5;

CameraModel CommonCameraOf(const CamerasOfImages& cameras, std::size_t num_images,
                           const FrameSourceOptions& options) {
  std::vector<PhotosOfCamera> all;
  for (const CameraModel& camera : cameras.cameras) all.push_back({camera, 0});
  for (std::size_t i = 0; i < num_images; ++i) {
    ++all[cameras.Of(static_cast<std::int64_t>(i))].num_photos;
  }
  const cv::Size largest =
      options.resize.empty() ? cv::Size(options.max_side_px, options.max_side_px) : cv::Size();
  const cv::Size limit = ParseSize(options.resize).value_or(largest);
  return CommonCamera(all, limit.width, limit.height);
}

// The camera at the size from which its images are brought into the common one.
CameraModel BeforeUndistortion(const CameraModel& camera, const CameraModel& common) {
  const CameraModel undistorted = Undistorter(camera).camera();
  const double scale = common.fx / std::sqrt(undistorted.fx * undistorted.fy);
  if (scale * kMaxStep_px >= 1) return camera;
  return camera.Resized(std::max(1, static_cast<int>(std::lround(scale * camera.width))),
                        std::max(1, static_cast<int>(std::lround(scale * camera.height))));
}

// Brings the images of several cameras into those of one.
class CommonFrames : public FrameSource {
 public:
  CommonFrames(ImageList list, const CamerasOfImages& cameras, const FrameSourceOptions& options)
      : cameras_(cameras),
        camera_(CommonCameraOf(cameras, list.images.size(), options)),
        source_(OpenImageList(std::move(list), options)) {
    for (const CameraModel& camera : cameras_.cameras) {
      resized_.push_back(BeforeUndistortion(camera, camera_));
      undistorters_.emplace_back(resized_.back(), camera_);
    }
  }

  std::optional<Frame> Next() override {
    std::optional<SourceImage> image = source_->Next();
    if (!image) return std::nullopt;
    const std::size_t i = cameras_.Of(image->index);
    Frame frame;
    frame.index = image->index;
    frame.timestamp_s = image->timestamp_s;
    frame.name = image->name;
    frame.bgr = undistorters_[i].Undistort(Resize(*image, cameras_.cameras[i], resized_[i]));
    frame.camera = camera_;
    frame.content = undistorters_[i].content();
    if (frame.content.size() == frame.bgr.size()) frame.content = {};
    return frame;
  }

  std::optional<std::int64_t> num_frames() const override { return source_->num_frames(); }
  std::int64_t num_skipped() const override { return source_->num_skipped(); }
  std::int64_t num_passed_over() const override { return source_->num_passed_over(); }
  const CameraModel& camera() const override { return camera_; }

 private:
  static cv::Mat Resize(const SourceImage& image, const CameraModel& taken,
                        const CameraModel& resized) {
    if (image.bgr.cols != taken.width || image.bgr.rows != taken.height) {
      throw Error(ErrorParts{
          .what = "image has another size than its camera",
          .where = image.name,
          .expected = std::to_string(taken.width) + "x" + std::to_string(taken.height),
          .found = std::to_string(image.bgr.cols) + "x" + std::to_string(image.bgr.rows)});
    }
    const cv::Size target(resized.width, resized.height);
    if (target == image.bgr.size()) return image.bgr;
    cv::Mat smaller;
    cv::resize(image.bgr, smaller, target, 0, 0, cv::INTER_AREA);
    return smaller;
  }

  CamerasOfImages cameras_;
  CameraModel camera_;
  std::unique_ptr<ImageSource> source_;
  std::vector<CameraModel> resized_;  // of each camera
  std::vector<Undistorter> undistorters_;
};

}  // namespace

std::size_t CamerasOfImages::Of(std::int64_t image) const {
  const auto i = static_cast<std::size_t>(image);
  return i < camera_of_image.size() ? camera_of_image[i] : 0;
}

std::unique_ptr<FrameSource> OpenFrameSource(const std::string& input,
                                             const CamerasOfImages& cameras,
                                             const FrameSourceOptions& options) {
  options.Validate();
  if (cameras.cameras.size() == 1) return OpenFrameSource(input, cameras.cameras[0], options);
  if (cameras.cameras.empty()) throw Error("frame source: no camera");
  for (const std::size_t camera : cameras.camera_of_image) {
    if (camera >= cameras.cameras.size()) throw Error("frame source: image of no known camera");
  }
  return std::make_unique<CommonFrames>(FindImages(input), cameras, options);
}

}  // namespace mono3d
