// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/true_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

using Cell = std::array<std::int32_t, 3>;

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    // Primes after Teschner et al. 2003.
    return (static_cast<std::size_t>(cell[0]) * 73856093U) ^
           (static_cast<std::size_t>(cell[1]) * 19349663U) ^
           (static_cast<std::size_t>(cell[2]) * 83492791U);
  }
};

struct Sample {
  Vector3f p;
  Vector3f normal;
  std::array<std::uint8_t, 3> rgb{};
  float off_middle = 0;  // squared distance from the middle of the cell, in edges of a cell
  std::uint32_t observations = 0;
  std::int32_t last_image = -1;
};

// The samples of two images may be equally near; then the place decides, not the order.
bool IsBetter(const Sample& a, const Sample& b) {
  if (a.off_middle != b.off_middle) return a.off_middle < b.off_middle;
  return std::lexicographical_compare(a.p.data(), a.p.data() + 3, b.p.data(), b.p.data() + 3);
}

void RequireImage(const CameraModel& camera, const cv::Mat& bgr) {
  if (camera.HasDistortion()) throw Error("the true cloud needs a camera without distortion");
  if (bgr.type() == CV_8UC3 && bgr.cols == camera.width && bgr.rows == camera.height) return;
  throw Error(ErrorParts{
      .what = "true cloud: the image does not fit the camera",
      .where = {},
      .expected = std::to_string(camera.width) + "x" + std::to_string(camera.height) + " in colour",
      .found = std::to_string(bgr.cols) + "x" + std::to_string(bgr.rows)});
}

}  // namespace

struct TrueCloud::Impl {
  double voxel_m = 0;
  double max_depth_m = 0;
  std::int32_t num_images = 0;
  std::unordered_map<Cell, Sample, CellHash> samples;

  void Insert(Sample sample) {
    const Eigen::Vector3d place = sample.p.cast<double>() / voxel_m;
    const Eigen::Vector3d corner = place.array().floor();
    sample.off_middle =
        static_cast<float>((place - corner - Eigen::Vector3d::Constant(0.5)).squaredNorm());
    const Cell cell = {static_cast<std::int32_t>(corner.x()), static_cast<std::int32_t>(corner.y()),
                       static_cast<std::int32_t>(corner.z())};
    const auto [found, is_new] = samples.try_emplace(cell, sample);
    Sample& kept = found->second;
    const bool is_first_of_image = kept.last_image != num_images;
    sample.observations = kept.observations + (is_first_of_image ? 1U : 0U);
    sample.last_image = num_images;
    if (!is_new && !IsBetter(sample, kept)) {
      kept.observations = sample.observations;
      kept.last_image = sample.last_image;
      return;
    }
    kept = sample;
  }
};

TrueCloud::TrueCloud(double voxel_m, double max_depth_m) : impl_(std::make_unique<Impl>()) {
  if (!(voxel_m > 0) || !std::isfinite(voxel_m) || !(max_depth_m > 0)) {
    throw Error("true cloud: voxel and largest depth must be above 0");
  }
  impl_->voxel_m = voxel_m;
  impl_->max_depth_m = max_depth_m;
}

TrueCloud::~TrueCloud() = default;
TrueCloud::TrueCloud(TrueCloud&&) noexcept = default;
TrueCloud& TrueCloud::operator=(TrueCloud&&) noexcept = default;

void TrueCloud::Add(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam,
                    const cv::Mat& bgr) {
  RequireImage(camera, bgr);
  const Vector3f origin = T_world_cam.translation().cast<float>();
  const Eigen::Matrix3f R_world_cam = T_world_cam.rotation().toRotationMatrix().cast<float>();
  std::vector<std::vector<Sample>> rows(static_cast<std::size_t>(camera.height));
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& range) {
    for (int y = range.start; y < range.end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Vector3f direction_cam =
            camera.Unproject({static_cast<double>(x), static_cast<double>(y)}).cast<float>();
        const std::optional<Hit> hit = scene.Intersect({origin, R_world_cam * direction_cam});
        // The ray's direction has z = 1: the distance is the depth.
        if (!hit || hit->is_moving || hit->distance > impl_->max_depth_m) continue;
        const auto& pixel = bgr.at<cv::Vec3b>(y, x);
        Sample sample;
        sample.p = hit->p;
        sample.normal = hit->normal;
        sample.rgb = {pixel[2], pixel[1], pixel[0]};
        rows[static_cast<std::size_t>(y)].push_back(sample);
      }
    }
  });
  for (const std::vector<Sample>& row : rows) {
    for (const Sample& sample : row) impl_->Insert(sample);
  }
  ++impl_->num_images;
}

PointCloud TrueCloud::Build() const {
  std::vector<std::pair<Cell, const Sample*>> order;
  order.reserve(impl_->samples.size());
  for (const auto& [cell, sample] : impl_->samples) order.emplace_back(cell, &sample);
  std::sort(order.begin(), order.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  PointCloud cloud;
  for (const auto& [cell, sample] : order) {
    cloud.points.push_back(sample->p);
    cloud.normals.push_back(sample->normal);
    cloud.colours.push_back(sample->rgb);
    cloud.observations.push_back(sample->observations);
  }
  return cloud;
}

}  // namespace mono3d::synthetic
