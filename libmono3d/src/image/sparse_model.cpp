// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/sparse_model.h"

#include <set>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

void Refuse(const std::string& what, const SparseImage& image) {
  throw Error(ErrorParts{
      .what = "sparse model: " + what, .where = image.name, .expected = {}, .found = {}});
}

void ValidateImage(const SparseImage& image, std::size_t num_points) {
  if (!image.T_world_cam.Matrix().allFinite()) Refuse("pose is not finite", image);
  for (const SparseObservation& observation : image.observations) {
    if (!observation.pixel.allFinite()) Refuse("pixel is not finite", image);
    if (observation.point && *observation.point >= num_points) {
      Refuse("observation of a point that is not there", image);
    }
  }
}

}  // namespace

std::vector<double> ReprojectionErrors_px(const SparseModel& model) {
  std::vector<double> sum(model.points.size(), 0);
  std::vector<int> count(model.points.size(), 0);
  for (const SparseImage& image : model.images) {
    const Pose T_cam_world = image.T_world_cam.Inverse();
    for (const SparseObservation& observation : image.observations) {
      if (!observation.point) continue;
      const Eigen::Vector3d p_cam = T_cam_world * model.points[*observation.point].p_world;
      if (p_cam.z() <= 0) continue;
      sum[*observation.point] +=
          (ProjectDistorted(model.CameraOf(image), p_cam) - observation.pixel).norm();
      ++count[*observation.point];
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (count[i] > 0) sum[i] /= count[i];
  }
  return sum;
}

SparseModel WithCamera(const SparseModel& model, const CameraModel& camera) {
  return WithCameras(model, std::span(&camera, 1), [](std::int64_t) { return std::size_t{0}; });
}

SparseModel WithCameras(const SparseModel& model, std::span<const CameraModel> cameras,
                        const std::function<std::size_t(std::int64_t)>& camera_of_id) {
  SparseModel result = model;
  result.camera = cameras.front();
  result.further_cameras.assign(cameras.begin() + 1, cameras.end());
  for (SparseImage& image : result.images) {
    image.camera = camera_of_id(image.id);
    const CameraModel& camera = result.CameraOf(image);
    const ShutterMotion motion(camera, image.velocity.value_or(CameraVelocity()));
    const Pose T_cam_world = image.T_world_cam.Inverse();
    for (SparseObservation& observation : image.observations) {
      Eigen::Vector3d ray = model.camera.Unproject(observation.pixel);
      if (observation.point && !motion.IsStill()) {
        const Eigen::Vector3d p_cam = T_cam_world * model.points[*observation.point].p_world;
        if (p_cam.z() > 0) ray += (motion.AtItsLine(p_cam) - p_cam) / p_cam.z();
      }
      observation.pixel = ProjectDistorted(camera, ray);
    }
  }
  return result;
}

void Validate(const SparseModel& model) {
  Validate(model.camera, "sparse model");
  for (const CameraModel& camera : model.further_cameras) Validate(camera, "sparse model");
  std::set<std::int64_t> ids;
  for (const SparseImage& image : model.images) {
    if (!ids.insert(image.id).second) Refuse("two images of one id", image);
    if (image.camera > model.further_cameras.size()) Refuse("image of no known camera", image);
    ValidateImage(image, model.points.size());
  }
  for (const SparsePoint& point : model.points) {
    if (!point.p_world.allFinite()) throw Error("sparse model: point is not finite");
  }
}

}  // namespace mono3d
