// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <opencv2/core/types.hpp>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/pose.h"

namespace mono3d {

// The surface within one cell of a grid.
struct SurfaceCell {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of its surfels
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double confidence = 0;    // mean
  double observations = 0;  // mean
  double inferred = 0;      // share of the surfels
};

// A grid around a model, and the model's surface in its cells.
class CellGrid {
 public:
  // Without the outermost surfels. The edge of a cell is `cell_su`, or more where there would be
  // too many.
  CellGrid(const PointCloud& model, double cell_su);

  double cell_su() const { return cell_su_; }
  const Eigen::Vector3i& size() const { return size_; }
  std::size_t num_cells() const { return touched_.size(); }
  // From 0 to num_cells; x runs first.
  std::size_t Index(const Eigen::Vector3i& cell) const;
  bool Contains(const Eigen::Vector3i& cell) const;
  Eigen::Vector3i CellAt(const Eigen::Vector3d& p) const;
  Eigen::Vector3d Centre(const Eigen::Vector3i& cell) const;

  // Is there any surfel?
  bool IsTouched(std::size_t index) const { return touched_[index] != 0; }
  // Those that are covered to a good part.
  const std::vector<SurfaceCell>& surface() const { return surface_; }

 private:
  double cell_su_;
  Eigen::Vector3d low_;
  Eigen::Vector3i size_;
  std::vector<std::uint8_t> touched_;
  std::vector<SurfaceCell> surface_;
};

// Where a camera without distortion sees points of the world.
class PinholeView {
 public:
  PinholeView(const CameraModel& camera, const Pose& T_world_cam);

  const CameraModel& camera() const { return camera_; }
  Eigen::Vector3d InCamera(const Eigen::Vector3d& p_world) const { return R_ * p_world + t_; }
  Eigen::Vector3d Turned(const Eigen::Vector3d& direction_world) const {
    return R_ * direction_world;
  }
  // Is the point before the camera, and its pixel between the middles of the outermost ones?
  bool Sees(const Eigen::Vector3d& p_cam) const {
    const double x = camera_.fx * p_cam.x();
    const double y = camera_.fy * p_cam.y();
    const double z = p_cam.z();
    return z > 0 && x >= left_ * z && x <= right_ * z && y >= top_ * z && y <= bottom_ * z;
  }

 private:
  CameraModel camera_;
  Eigen::Matrix3d R_;  // camera from world
  Eigen::Vector3d t_;
  double left_, right_, top_, bottom_;  // of the picture from the principal point, px
};

// The depth at which a camera sees the surface of cells, each drawn as a disc.
class CellPicture {
 public:
  // Empty. `camera` has no distortion.
  CellPicture(const CameraModel& camera, const Pose& T_world_cam);

  // Cells whose middle is above `min_depth_su` and not above `max_depth_su` away; none is drawn
  // that is nearer than its size.
  void Draw(std::span<const SurfaceCell> surface, double cell_su, double min_depth_su = 0,
            double max_depth_su = std::numeric_limits<double>::infinity());

  // Of a point of the world: its depth, and that of the surface at its pixel, infinite where there
  // is none. Depth 0: the camera does not see there.
  struct Depths {
    double point = 0;
    double surface = 0;
  };
  Depths At(const Eigen::Vector3d& p_world) const;
  double ShareCovered() const;  // of the picture

  // Above the skyline nothing stands before anything: from now on the surface there is far away.
  // Not of a camera that looks down or lies on its side, whose rays end on the ground beyond the
  // model.
  void OpenSky(const Eigen::Vector3d& up_world);

 private:
  // That the disc may cover.
  cv::Rect PixelsOfDisc(const Eigen::Vector3d& centre_cam, double radius_su) const;
  void DrawDisc(const cv::Rect& pixels, const Eigen::Vector3d& centre_cam,
                const Eigen::Vector3d& normal_cam, double radius_su);

  PinholeView view_;
  std::vector<float> depths_;
  std::vector<double> rays_x_;  // of the columns of pixels
};

}  // namespace mono3d
