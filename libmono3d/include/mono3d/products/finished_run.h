// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/sparse_model.h"

namespace MONO3D_EXPORT mono3d {

// A keyframe of a run.
struct RunImage {
  std::string name;                  // as sparse/ has it
  std::filesystem::path file;        // the image as it was taken; empty: it is not there (any more)
  CameraModel camera;                // with its distortion, of the pixels of `file`
  Pose T_world_cam;                  // in the axes and the unit of model.ply
  std::filesystem::path depth;       // empty: none was written
  std::filesystem::path confidence;  // of the depth map; empty: none was written
};

// What mono3d-reconstruct left in the folder of a run, its first map. The model itself may be large
// and is read apart, from `model`.
struct FinishedRun {
  std::filesystem::path folder;
  std::filesystem::path model;   // model.ply
  std::filesystem::path mesh;    // mesh.ply; empty: none was written
  std::vector<RunImage> images;  // in the order of the run
  SparseModel sparse;            // of these images
  CameraModel depth_camera;      // of the depth maps, free of distortion; width 0: there are none
  double depth_unit = 1;         // of the depth maps, in units of the model
  // Where the axes of the model (x east, y north, z up, metres) begin; nothing: the run had no
  // positions, and its axes and unit are its own.
  std::optional<Geodetic> origin;
  bool is_altitude_known = false;  // origin.altitude_m is above the ellipsoid, or as the drone said
};

// Throws Error where there is no run with a model in the folder. What else is missing or damaged is
// left out, with a warning in the log.
FinishedRun ReadFinishedRun(const std::filesystem::path& folder);

}  // namespace mono3d
