// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/products/coordinate_system.h"
#include "mono3d/products/finished_run.h"

namespace MONO3D_EXPORT mono3d {

// A way from one set of axes to another that holds around a place: to = linear * (from - centre).
struct AffineMap {
  Eigen::Vector3d centre_from = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_to = Eigen::Vector3d::Zero();
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();

  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const {
    return centre_to + linear * (p - centre_from);
  }
};

// The axes that products of a survey are in, x to the right on a map, y up on it, z the height:
// those of a coordinate reference system, or those of the model where the run had no positions.
// For one thread at a time.
class MapAxes {
 public:
  MapAxes() = default;  // of the model
  explicit MapAxes(CoordinateSystem system);

  const CoordinateSystem* system() const { return system_ ? &*system_ : nullptr; }
  // Units of x and y in units of the model: 1 but for systems in feet.
  double ModelUnitsPerUnit() const { return system_ ? system_->metres_per_unit() : 1; }

  Eigen::Vector3d ToMap(const Eigen::Vector3d& p_model) const;
  Eigen::Vector3d ToModel(const Eigen::Vector3d& p_map) const;

  // The earth bends by x^2 / (2 * 6.4e6 m): within kCell of the place, an affine map is exact to
  // 0.1 mm. Costs as much as seven single points.
  static constexpr double kCell = 32;
  AffineMap ToMapNear(const Eigen::Vector3d& p_model) const;
  AffineMap ToModelNear(const Eigen::Vector3d& p_map) const;

 private:
  std::optional<CoordinateSystem> system_;
};

// Of the products of a run: `definition` names the system, and is empty for the UTM zone of its
// origin. Axes of the model where the run has no origin; throws UsageError where a system is asked
// for all the same, and Error as CoordinateSystem does.
MapAxes AxesOfProducts(const FinishedRun& run, const std::string& definition);

// One line about what the coordinates of the products are: "WGS 84 / UTM zone 32N; heights above
// the ellipsoid WGS 84".
std::string AxesLine(const FinishedRun& run, const MapAxes& axes);

}  // namespace mono3d
