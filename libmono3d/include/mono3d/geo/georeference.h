// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geo/position_track.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/camera_positions.h"

namespace MONO3D_EXPORT mono3d {

struct GeoreferenceOptions {
  // Time of an image = time of a fix + clock_offset_s.
  double clock_offset_s = 0;
  double clock_offset_sigma_s = 2;  // how well that is known; 0: exactly
  double max_clock_offset_s = 5;    // it is looked for up to this far from clock_offset_s
  // Where the antenna is, in the axes of the camera (x right, y down, z forward).
  double antenna_right_m = 0;
  double antenna_down_m = 0;
  double antenna_forward_m = 0;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// A camera with what finds its fix.
struct PositionedCamera {
  double timestamp_s = 0;  // for tracks with PositionClock::kImages the index of its frame
  std::string image;       // file name; for tracks with PositionClock::kImages
  Pose T_map_cam;
};

// Which way is up, in the axes of the map, as far as it is known without positions.
struct UpDirection {
  Eigen::Vector3d up_map = Eigen::Vector3d::UnitZ();
  double sigma_rad = 0;  // of each of the two angles
};

// What one fix differs by from the camera that it belongs to.
struct PositionResidual {
  std::size_t fix = 0;  // index in PositionTrack::fixes
  // Of the images; where fixes belong to images by name, since the first of them was taken, or,
  // where that is not told, the number of the image.
  double time_s = 0;
  Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();  // fix - camera
  bool is_outlier = false;                          // it was not used
  std::string image = {};                           // by whose name it belongs to the camera
  std::optional<double> taken_s = {};               // when that was taken, as of kUnix
};

// What became of a ground control point.
struct ControlResidual {
  std::string name;
  bool is_check = false;
  bool is_used = false;
  bool is_seen = false;       // the map has it, by two marks or more; without, what follows is 0
  bool has_height = true;     // surveyed
  std::string why_unused;     // in words; empty: it was used, or is a check point
  std::size_t num_marks = 0;  // in images of the run
  std::size_t num_marks_used = 0;
  std::vector<std::string> contradicting_images;    // whose marks do not agree with the others
  Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();  // map - survey
  double rms_px = 0;  // of its used marks from where the map shows the surveyed place
};

// Where a map is on the earth.
struct Georeference {
  Geodetic origin;               // of the axes x east, y north, z up: the first fix that was used
  Similarity S_enu_map;          // metres
  bool has_altitude = false;     // otherwise z counts from take-off, or from the first camera
  double scale_sigma = 0;        // relative
  double heading_sigma_rad = 0;  // about the vertical
  double tilt_sigma_rad = 0;     // about the worse horizontal axis
  Eigen::Vector3d position_sigma_m = Eigen::Vector3d::Zero();  // of the middle of the cameras
  double clock_offset_s = 0;
  double clock_offset_sigma_s = 0;  // 0: not estimated
  // Of the increments (east, north, up of the cameras' middle in m; rotation about east, north, up
  // in rad; logarithm of the scale; clock offset in s).
  Eigen::Matrix<double, 8, 8> covariance = Eigen::Matrix<double, 8, 8>::Zero();
  PositionNoise horizontal;  // of east and north each, as found in the residuals
  PositionNoise vertical;
  std::vector<PositionResidual> residuals;  // of the fixes that belong to a camera
  std::size_t num_used = 0;
  double rms_horizontal_m = 0;  // of the used ones: root of the mean squared distance
  double rms_vertical_m = 0;
  // By ground control points, and not by the positions of the cameras: then all of these are 0.
  bool is_by_control = false;
  std::string why_no_control;            // where there are ground control points, but it is not
  std::vector<ControlResidual> control;  // in the order of GroundControl::points
};

// Either a georeference, or the reason why there is none.
struct GeoreferenceResult {
  std::optional<Georeference> georeference;
  std::string reason;
};

// The similarity that brings the cameras of one map onto their positions, its standard deviations,
// and the offset between the clocks (not where fixes belong to images by name). Positions err by a
// wandering and a white part; how large they are comes from the residuals and from what receivers
// of their kind do, and the result is the mean over what is likely (Bayesian model averaging), so
// that its covariance knows of it. Single fixes that are far off are left out. What positions along
// a straight line do not tell, the roll about it, comes from `up`; without it such a map has none.
// `cameras` in the order of their times. Takes O(cameras + fixes). Throws nothing but UsageError.
GeoreferenceResult EstimateGeoreference(std::span<const PositionedCamera> cameras,
                                        const PositionTrack& track,
                                        const std::optional<UpDirection>& up,
                                        const GeoreferenceOptions& options = {});

// Where the fixes of a track have the cameras of a map that has a georeference, for
// Tracker::FollowPositions: metres in its axes, the arm to the antenna taken off. Fixes of a
// receiver that had stopped are left out, but no others, as the path may have drifted. Of a track
// with PositionClock::kImages each names its frame, the time stamp of its camera, and its standard
// deviations: as the receiver states them, else as the residuals of the georeference have them.
CameraPositions CameraPositionsOf(std::span<const PositionedCamera> cameras,
                                  const PositionTrack& track, const Georeference& georeference,
                                  const GeoreferenceOptions& options = {});

// Where the axes of EstimateGeoreference begin, whichever fixes are used; nothing without fixes.
std::optional<Geodetic> OriginOf(const PositionTrack& track);

// Which way is up by the gimbal angles of the fixes; nothing where fewer than three cameras have
// them. The cameras' yaw is not used: it comes from a compass.
std::optional<UpDirection> UpFromGimbal(std::span<const PositionedCamera> cameras,
                                        const PositionTrack& track);

}  // namespace mono3d
