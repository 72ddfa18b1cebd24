// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"

namespace MONO3D_EXPORT mono3d {

// How well ground control points are known: standard deviations.
struct GroundControlOptions {
  double horizontal_m = 0.03;  // of east and north each, by a receiver with corrections
  double vertical_m = 0.05;
  double pixel_px = 1;  // of a mark in an image, in x and in y

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// A mark as a line of sight.
struct ControlSight {
  std::int64_t frame_index = 0;                        // of the image in the input
  std::string image;                                   // its file name
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();     // of the image as it was taken
  Eigen::Vector3d ray_cam = Eigen::Vector3d::UnitZ();  // at z = 1, free of distortion
  double focal_px = 1;                                 // pixels of the image of 1 at z = 1
  // When the line that it is on was read, after the middle line; 0: a global shutter, or nobody
  // knows how the camera moved.
  double line_s = 0;
};

// A surveyed point that has a place on the earth, and where it was seen.
struct ControlPoint {
  std::string name;
  Geodetic place;  // altitude 0 where it is not known
  bool has_height = true;
  bool is_check = false;
  std::vector<ControlSight> sights;
};

struct GroundControl {
  std::string source;
  std::vector<ControlPoint> points;
  bool has_altitude = false;  // above the ellipsoid; else above whatever the survey counts from
  GroundControlOptions options;
};

// A pose of a frame, in the axes of a map: that of the middle line of a rolling shutter.
struct FrameInMap {
  std::int64_t frame_index = 0;
  Pose T_map_cam;
  CameraVelocity velocity = {};  // in units of the map; of use for ControlSight::line_s
};

// The place of the first point: an origin for the axes of all maps of a run.
std::optional<Geodetic> OriginOf(const GroundControl& control);

// The similarity that brings the points that were marked in the images of a map onto where they
// were surveyed. A point is where its lines of sight meet; marks that contradict the others of the
// same point are left out, and then points that contradict all others (each against the fit of the
// others, their own scatter taken into account). Needs three points, not on a line unless `up` is
// known. `frames` by ascending index. What becomes of each point is in
// Georeference::control, of check points as well.
GeoreferenceResult EstimateGeoreference(std::span<const FrameInMap> frames,
                                        const GroundControl& control, const Geodetic& origin,
                                        const std::optional<UpDirection>& up);

// What the points of a map are off by, none of which was used: they are all check points.
std::vector<ControlResidual> ControlResidualsOf(std::span<const FrameInMap> frames,
                                                const GroundControl& control,
                                                const Georeference& georeference);

// The points that were used for `georeference`, with the marks that were, for
// Tracker::FollowPositions: each where the frame would show it, were all lines read with the middle
// one. `frames` as they were for the georeference.
std::vector<KnownPoint> KnownPointsOf(std::span<const FrameInMap> frames,
                                      const GroundControl& control,
                                      const Georeference& georeference);

}  // namespace mono3d
