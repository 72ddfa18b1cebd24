// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// Reads the calibration of one camera. The content decides on the form:
// - YAML with image_width, image_height, camera_matrix and distortion_coefficients
//   (k1 k2 p1 p2 [k3]), as cv::FileStorage and ROS camera_calibration write it. Those of a fisheye
//   lens are k1 k2 k3 k4, with distortion_model: equidistant (ROS) or fisheye, or fisheye_model: 1
//   (OpenCV's calibration program). A rolling shutter has line_delay_s as well: the seconds from a
//   line of the image to the next, negative where the last one is read first. readout_direction
//   tells the lines: rows (down, the default, or up) or columns (right or left); up and left begin
//   at the last line whatever the sign;
//   Without distortion_coefficients there is no distortion. The XML and JSON of cv::FileStorage are
//   read as well;
// - what Kalibr (camchain.yaml, cam0 alone), ORB-SLAM (Camera.fx ...) and nerfstudio
//   (transforms.json) write;
// - COLMAP's cameras.txt or cameras.bin with one camera, of the models SIMPLE_PINHOLE, PINHOLE,
//   SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV with k4 = k5 = k6 = 0, SIMPLE_RADIAL_FISHEYE,
//   RADIAL_FISHEYE and OPENCV_FISHEYE. Its pixel (0, 0) is a corner, ours is a pixel's centre: 0.5
//   is taken off the principal point. It has no shutter.
// Throws Error with file, line, expected and found: kNotFound without a file, kUnsupported for
// other camera models and distortions, kInvalidInput for wrong content.
CameraModel ReadCameraFile(const std::filesystem::path& path);

// Writes the YAML form, of a fisheye lens with distortion_model: equidistant; every number
// survives, a readout time but for its last bit.
void WriteCameraFile(const std::filesystem::path& path, const CameraModel& camera);

}  // namespace mono3d
