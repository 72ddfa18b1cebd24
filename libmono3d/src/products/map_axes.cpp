// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/map_axes.h"

#include <utility>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// By central differences: exact to the third order of the distance over the radius of the earth.
template <typename Function>
AffineMap AffineMapAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& step,
                      const Function& map) {
  AffineMap affine{.centre_from = centre, .centre_to = map(centre)};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d along = step[k] * Eigen::Vector3d::Unit(k);
    affine.linear.col(k) = (map(centre + along) - map(centre - along)) / (2 * step[k]);
  }
  return affine;
}

}  // namespace

MapAxes::MapAxes(CoordinateSystem system) : system_(std::move(system)) {}

Eigen::Vector3d MapAxes::ToMap(const Eigen::Vector3d& p_model) const {
  return system_ ? system_->ToMap(p_model) : p_model;
}

Eigen::Vector3d MapAxes::ToModel(const Eigen::Vector3d& p_map) const {
  return system_ ? system_->ToEnu(p_map) : p_map;
}

AffineMap MapAxes::ToMapNear(const Eigen::Vector3d& p_model) const {
  if (!system_) return {};
  return AffineMapAt(p_model, Eigen::Vector3d::Constant(kCell),
                     [&](const Eigen::Vector3d& p) { return system_->ToMap(p); });
}

AffineMap MapAxes::ToModelNear(const Eigen::Vector3d& p_map) const {
  if (!system_) return {};
  const double across = kCell / ModelUnitsPerUnit();
  return AffineMapAt(p_map, {across, across, kCell},
                     [&](const Eigen::Vector3d& p) { return system_->ToEnu(p); });
}

MapAxes AxesOfProducts(const FinishedRun& run, const std::string& definition) {
  if (!run.origin) {
    if (definition.empty()) return {};
    throw UsageError(ErrorParts{.what = "the run has no positions, and its model no place on earth",
                                .where = "--crs " + definition,
                                .expected = "a run of images with positions (--positions)",
                                .found = run.folder.string()});
  }
  if (definition.empty() && !CoordinateSystem::IsSupported()) return {};
  return MapAxes(CoordinateSystem(definition.empty() ? UtmCodeOf(*run.origin) : definition,
                                  *run.origin, run.is_altitude_known));
}

std::string AxesLine(const FinishedRun& run, const MapAxes& axes) {
  if (axes.system() == nullptr) {
    return run.origin ? "no coordinate system: mono3d was built without PROJ; metres east, north, "
                        "up of the origin of the run"
                      : "no coordinate system: the run has no positions; coordinates are those of "
                        "model.ply";
  }
  if (axes.system()->has_heights()) return axes.system()->name();
  return axes.system()->name() +
         (run.is_altitude_known
              ? "; heights above the ellipsoid WGS 84"
              : "; heights as the drone or the survey has them, above a start or a sea, not the "
                "ellipsoid");
}

}  // namespace mono3d
