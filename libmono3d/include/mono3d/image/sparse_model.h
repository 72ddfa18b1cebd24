// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"

namespace MONO3D_EXPORT mono3d {

// Where an image shows a point of a sparse model; of a rolling shutter, where it would show it if
// all lines were read with the middle one.
struct SparseObservation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  std::optional<std::size_t> point;  // position in SparseModel::points
};

struct SparseImage {
  std::int64_t id = 0;  // each once, 0 or more
  std::string name;     // file name
  Pose T_world_cam;     // at the middle line of a rolling shutter
  std::vector<SparseObservation> observations;
  // How the camera moved at that moment, where it is known, in su of the model.
  std::optional<CameraVelocity> velocity = {};
  std::size_t camera = 0;  // which one took it: see SparseModel::CameraOf
};

struct SparsePoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  // su
  std::array<std::uint8_t, 3> colour = {0, 0, 0};     // red, green, blue
};

// What bundle adjustment has found out: the poses of some images, mostly of one camera, scene
// points, and where the images show them.
struct SparseModel {
  CameraModel camera;
  std::vector<CameraModel> further_cameras = {};  // of images whose camera is 1, 2, ...
  std::vector<SparseImage> images;
  std::vector<SparsePoint> points;

  const CameraModel& CameraOf(const SparseImage& image) const {
    return image.camera == 0 ? camera : further_cameras.at(image.camera - 1);
  }
};

// Mean distance in px between the pixel of an observation and its point's projection through the
// camera with its distortion, over the observations of each point; 0 for a point that none shows or
// that lies behind a camera.
std::vector<double> ReprojectionErrors_px(const SparseModel& model);

// The same model as the images show it that the lens with the distortion `camera` takes: every
// pixel goes where that camera shows its ray. Where its shutter is a rolling one and the velocity
// of an image is known, pixels with a point go where the image shows them, its lines read one after
// the other. `model.camera` must be free of distortion.
SparseModel WithCamera(const SparseModel& model, const CameraModel& camera);

// The same of images of several cameras: `camera_of_id` gives that of the image with an id.
SparseModel WithCameras(const SparseModel& model, std::span<const CameraModel> cameras,
                        const std::function<std::size_t(std::int64_t)>& camera_of_id);

// Throws Error when an observation names a point that is not there, an image a camera, two images
// have one id, or a number is not finite.
void Validate(const SparseModel& model);

}  // namespace mono3d
