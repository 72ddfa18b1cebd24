// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>

#include "mono3d/core/export.h"
#include "mono3d/geometry/geodetic.h"

namespace MONO3D_EXPORT mono3d {

// The zone of the universal transverse Mercator projection that a place belongs to, on WGS 84, with
// the wider zones of Norway and Svalbard: "EPSG:32632". Towards the poles, where UTM ends, the
// universal polar stereographic projection: "EPSG:32661", "EPSG:32761".
std::string UtmCodeOf(const Geodetic& place);

// A projected coordinate reference system, and the way between it and local metres (x east, y
// north, z up) about an origin. Map coordinates are easting, northing, height, whatever the order
// of the axes that the system's own definition has. Heights are above the ellipsoid WGS 84, and
// those of the vertical system where the reference system is a compound one.
// An object is for one thread at a time.
class CoordinateSystem {
 public:
  // `definition`: a code ("EPSG:25832", "EPSG:25832+7837"), WKT or whatever PROJ knows. Throws
  // Error where PROJ does not know it, where it is not projected (angles are no lengths), where
  // heights cannot be brought into it (a file of PROJ is missing, or `is_altitude_known` says that
  // the origin's altitude is not above the ellipsoid), and (kUnsupported) where mono3d was built
  // without PROJ.
  CoordinateSystem(const std::string& definition, const Geodetic& origin, bool is_altitude_known);
  ~CoordinateSystem();
  CoordinateSystem(CoordinateSystem&&) noexcept;
  CoordinateSystem& operator=(CoordinateSystem&&) noexcept;

  static bool IsSupported();  // was mono3d built with PROJ?
  // Is it a projected one, or a compound one of which a part is? Throws Error where PROJ does not
  // know it, and (kUnsupported) without PROJ.
  static bool IsProjected(const std::string& definition);
  // Where coordinates (easting, northing, height, or longitude, latitude, height) are on WGS 84, by
  // the way that PROJ thinks best for the place. Heights stay as they are unless the system has
  // some of its own. Throws Error as above, and where the place is none.
  static Geodetic PlaceOf(const std::string& definition, const Eigen::Vector3d& p_map);

  const std::string& name() const;  // "WGS 84 / UTM zone 32N"
  const std::string& wkt2() const;  // ISO 19162:2019
  const std::string& wkt1() const;  // OGC 01-009, as LAS and older programs have it
  bool has_heights() const;         // is it a compound one?
  double metres_per_unit() const;   // of easting and northing

  Eigen::Vector3d ToMap(const Eigen::Vector3d& p_enu_m) const;
  Eigen::Vector3d ToEnu(const Eigen::Vector3d& p_map) const;

 private:
  struct Projection;
  std::unique_ptr<Projection> projection_;
};

}  // namespace mono3d
