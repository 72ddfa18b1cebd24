// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/photo_footage.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/geometry/distortion.h"
#include "tracking/photos/photo_mapping.h"

namespace mono3d::calibration {
namespace {

// Of the features: a focal length that is off by a third bends the rays by pixels.
constexpr double kCalibrationTolerance = 4;
// Half of the features of a run: the camera needs fewer points than the poses.
constexpr int kNumFeaturesOfRun = 2;
constexpr std::size_t kMaxPhotoPoints = 6000;

// The rays at z = 1 that a camera shows at its pixels.
class PhotoRays {
 public:
  explicit PhotoRays(const CameraModel& camera) : camera_(camera) {
    if (camera.lens == LensModel::kFisheye) angles_.emplace(camera.distortion);
  }

  Eigen::Vector3d At(const Eigen::Vector2d& pixel) const {
    return angles_ ? ThroughFisheye(pixel) : ByIteration(pixel);
  }

 private:
  // Photos are read with what lies 60 degrees off the axis at most; another camera may show it
  // farther out.
  Eigen::Vector3d ThroughFisheye(const Eigen::Vector2d& pixel) const {
    constexpr double kMaxAngle_rad = 1.4;
    Eigen::Vector3d ray = camera_.Unproject(pixel);
    const double radius = ray.head<2>().norm();
    if (radius == 0) return ray;
    const double angle = std::min(angles_->At(radius).value_or(kMaxAngle_rad), kMaxAngle_rad);
    ray.head<2>() *= std::tan(angle) / radius;
    return ray;
  }

  Eigen::Vector3d ByIteration(const Eigen::Vector2d& pixel) const {
    constexpr int kMaxSteps = 30;
    constexpr double kConverged_px = 1e-3;
    Eigen::Vector3d ray = camera_.Unproject(pixel);
    for (int i = 0; i < kMaxSteps; ++i) {
      const Eigen::Vector2d error = pixel - ProjectDistorted(camera_, ray);
      ray.x() += error.x() / camera_.fx;
      ray.y() += error.y() / camera_.fy;
      if (error.norm() < kConverged_px) break;
    }
    return ray;
  }

  CameraModel camera_;
  std::optional<FisheyeAngles> angles_;
};

// The points that most images show, and nothing of the others.
SparseModel WithFewerPoints(const SparseModel& model) {
  if (model.points.size() <= kMaxPhotoPoints) return model;
  std::vector<int> num_images(model.points.size(), 0);
  for (const SparseImage& image : model.images) {
    for (const SparseObservation& seen : image.observations) ++num_images[*seen.point];
  }
  std::vector<std::size_t> order(model.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater(),
                           [&](std::size_t point) { return num_images[point]; });
  order.resize(kMaxPhotoPoints);
  std::vector<std::optional<std::size_t>> kept(model.points.size());
  SparseModel result;
  result.camera = model.camera;
  for (const std::size_t point : order) {
    kept[point] = result.points.size();
    result.points.push_back(model.points[point]);
  }
  for (const SparseImage& image : model.images) {
    SparseImage& fewer = result.images.emplace_back(image);
    std::erase_if(fewer.observations,
                  [&](const SparseObservation& seen) { return !kept[*seen.point].has_value(); });
    for (SparseObservation& seen : fewer.observations) seen.point = kept[*seen.point];
  }
  return result;
}

}  // namespace

PhotoFootage::PhotoFootage(FrameSource& source, const CameraModel& read_with,
                           const PhotoMapperOptions& options)
    : PhotoFootage(
          source, std::span(&read_with, 1), [](std::int64_t) { return std::size_t{0}; }, options) {}

PhotoFootage::PhotoFootage(FrameSource& source, std::span<const CameraModel> read_with,
                           const std::function<std::size_t(std::int64_t)>& camera_of_frame,
                           const PhotoMapperOptions& options)
    : options_(options) {
  options_.num_features = std::max(500, options.num_features / kNumFeaturesOfRun);
  std::vector<tracking::PhotoFeatures> photos;
  std::vector<std::size_t> camera_of;
  std::vector<Photo> known;
  try {
    while (const std::optional<Frame> frame = source.Next()) {
      if (options_.IsStopped()) break;
      photos.push_back(
          tracking::ExtractPhotoFeatures(*frame, options_.num_features, options_.max_side_px));
      camera_of.push_back(camera_of_frame(frame->index));
      known.push_back({frame->index, frame->name, frame->timestamp_s});
      const CameraModel& taken_by = read_with[camera_of.back()];
      for (Eigen::Vector2d& pixel : photos.back().pixels) {
        pixel = ProjectDistorted(taken_by, frame->camera.Unproject(pixel));
      }
      if (!options_.on_progress) continue;
      options_.on_progress({PhotoMapperProgress::Step::kFeatures,
                            static_cast<std::int64_t>(photos.size()),
                            source.num_frames().value_or(0)});
    }
  } catch (const Error& error) {
    Log(LogLevel::kDebug, std::string("calibration: ") + error.what());
  }
  for (const std::size_t photo : tracking::OrderOfContent(photos)) {
    photos_.push_back(std::move(photos[photo]));
    camera_of_.push_back(camera_of[photo]);
    known_.push_back(std::move(known[photo]));
  }
  pairs_ = tracking::MatchPhotos(photos_, options_);
}

std::vector<SparseModel> PhotoFootage::Map(const CameraModel& camera) const {
  return Map(std::span(&camera, 1), camera.WithoutDistortion());
}

std::vector<SparseModel> PhotoFootage::Map(std::span<const CameraModel> cameras,
                                           const CameraModel& common) const {
  std::vector<tracking::PhotoFeatures> undistorted = photos_;
  std::vector<PhotoRays> rays;
  for (const CameraModel& camera : cameras) rays.emplace_back(camera);
  for (std::size_t i = 0; i < undistorted.size(); ++i) {
    const CameraModel& camera = cameras[camera_of_[i]];
    if (camera == common) continue;
    for (Eigen::Vector2d& pixel : undistorted[i].pixels) {
      pixel = common.Project(rays[camera_of_[i]].At(pixel));
    }
  }
  std::vector<tracking::PhotoTime> times;
  for (std::size_t i = 0; options_.are_frames && i < photos_.size(); ++i) {
    times.push_back({known_[i].timestamp_s, cameras[camera_of_[i]]});
  }
  std::vector<SparseModel> maps;
  for (const tracking::PhotoMap& map :
       tracking::MapPhotos(undistorted, pairs_, common, options_, kCalibrationTolerance, times)
           .maps) {
    maps.push_back(WithCameras(WithFewerPoints(map.sparse), cameras, [&](std::int64_t photo) {
      return camera_of_[static_cast<std::size_t>(photo)];
    }));
    for (SparseImage& image : maps.back().images) {
      const Photo& photo = known_[static_cast<std::size_t>(image.id)];
      image.id = photo.frame_index;
      image.name = photo.name;
    }
  }
  return maps;
}

}  // namespace mono3d::calibration
