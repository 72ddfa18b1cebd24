// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/image/keyframe.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// A keyframe as the choice of images sees it: its image, and the tracker's points in it. Where it
// is stands in the tracker's poses.
class View {
 public:
  View() = default;  // of nothing, to be read from a state
  explicit View(const Keyframe& keyframe);

  std::int64_t id() const { return keyframe_.id; }
  const Keyframe& keyframe() const { return keyframe_; }
  const CameraModel& camera() const { return keyframe_.frame.camera; }
  // Of the points in view, in the keyframe's own unit; 0 where there are none.
  double median_depth_su() const { return median_depth_su_; }

  // Points in view, in the camera frame and the keyframe's own unit: at most one of each cell of a
  // grid over the image, so that each stands for as much of the picture. A keyframe that does not
  // say where its points are has them all over the picture, at their median depth.
  std::span<const Eigen::Vector3d> points() const { return points_; }

  // Is this point (camera frame, own unit) in the picture, and not far behind what the keyframe's
  // own points show around that place?
  bool Sees(const Eigen::Vector3d& p_cam) const;

  // Sees() and the median depth stay.
  void ReleaseImageAndPoints();
  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  void TakePoints();
  void FindFarthest(const std::vector<std::vector<float>>& depths_of_cell);
  std::size_t CellOf(const Eigen::Vector2d& pixel) const;

  Keyframe keyframe_;
  double median_depth_su_ = 0;
  std::vector<Eigen::Vector3d> points_;
  // Of each cell, the farthest of the points in it and around it; infinite where they are few.
  std::vector<float> farthest_su_;
};

// Points of a reference in another view.
class Reprojection {
 public:
  // Both must have a pose in one map.
  Reprojection(const View& reference, const View& other, const KeyframePoses& poses);

  // How large the other view shows what is at the point (camera frame and own unit of the
  // reference) over how large the reference does; nothing where the other view does not see it.
  std::optional<double> Scale(const Eigen::Vector3d& p_ref) const;

  // Camera frame of the other view, own unit of it, into those of the reference.
  const Similarity& S_ref_other() const { return S_ref_other_; }

 private:
  const View& other_;
  Similarity S_ref_other_;
  Similarity S_other_ref_;
  double size_ = 1;
};

// Surfaces shown no more than this much smaller than in the reference are shown in its detail.
inline constexpr double kMinSharpScale = 0.8;

// What two views have in common, by the points of the first, the reference.
struct CommonView {
  double share = 0;           // of the reference's points that the other view sees
  double sharp_share = 0;     // of those that it shows in the reference's detail
  double angle_deg = 0;       // median angle between the rays from the two cameras
  double scale = 1;           // median size in the other view over the size in the reference
  double roll_deg = 0;        // between the two, about the optical axis, from the next quarter turn
  double baseline_ratio = 0;  // distance of the cameras over the median depth that the two see
  Eigen::Vector3d baseline_su;     // to the other camera, in the reference's frame and own unit
  std::vector<double> angles_deg;  // of each point that both see
};

// Both must have a pose in one map. O(points).
CommonView Compare(const View& reference, const View& other, const KeyframePoses& poses);

// The distance of the cameras over the median depth that the two see. O(1).
double BaselineRatio(const View& a, const View& b, const KeyframePoses& poses);

// Are both in the map?
bool AreInOneMap(const View& a, const View& b, const KeyframePoses& poses);

}  // namespace mono3d
