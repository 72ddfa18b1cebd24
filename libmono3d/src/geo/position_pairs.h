// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/smooth_path.h"
#include "mono3d/geo/georeference.h"

namespace mono3d {

// A fix and the camera at its time.
struct PositionPair {
  std::size_t fix = 0;
  // Of the images; where fixes belong to them by name, since the first was taken, or, where that is
  // not told, the index of the frame: as if one were taken each second.
  double time_s = 0;
  Eigen::Vector3d p_enu_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();         // camera centre
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();  // units of the map a second
  Eigen::Quaterniond R_map_cam = Eigen::Quaterniond::Identity();
  std::int64_t frame_index = -1;  // where it belongs to the camera by name
};

// Which of them have the place of the one before, though the camera has moved by more than `far_m`
// since that was first told: the receiver has stopped. `scale`: metres of the map's unit.
std::vector<bool> AreFrozen(const std::vector<PositionPair>& pairs, double scale, double far_m);

// The fixes of a track in local metres, and their cameras.
class PositionPairs {
 public:
  // The origin is the first fix. `cameras` and `track` must outlive this.
  PositionPairs(std::span<const PositionedCamera> cameras, const PositionTrack& track);

  // East, north, up of the first fix; up counts from there as well, by altitudes where all fixes
  // have one, by heights above take-off where all have that: a barometer's wander less.
  const Geodetic& origin() const { return origin_; }
  bool has_vertical() const { return has_vertical_; }
  bool has_altitude() const { return has_altitude_; }

  // Of the fixes that fall between two cameras, when `clock_offset_s` is added to their times, or
  // that belong to one by name; in the order of their times.
  std::vector<PositionPair> At(double clock_offset_s) const;

 private:
  void FindPlaces();
  std::vector<PositionPair> ByName() const;
  bool IsAcrossGap(std::size_t after) const;
  PositionPair Interpolated(std::size_t fix, double time_s, std::size_t after) const;
  Eigen::Vector3d CentreAt(double time_s) const;

  std::span<const PositionedCamera> cameras_;
  std::vector<TimedPoint> path_;  // of their centres
  const PositionTrack& track_;
  Geodetic origin_;
  bool has_vertical_ = false;
  bool has_altitude_ = false;
  std::vector<Eigen::Vector3d> p_enu_m_;  // of each fix
  double longest_gap_s_ = 0;              // between cameras that one is interpolated in
};

}  // namespace mono3d
