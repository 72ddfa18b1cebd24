// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/geodetic.h"

namespace MONO3D_EXPORT mono3d {

// Where somebody has marked a point in an image.
struct ControlMark {
  std::string image;                                // file name without its folder
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // (0, 0): the centre of the top-left pixel
  std::size_t line = 0;                             // of the file, from 1
};

// A point that was surveyed, as its file has it.
struct SurveyedPoint {
  std::string name;  // as the file has it, else "point 1", "point 2", ... in its order
  double x = 0;      // easting or longitude
  double y = 0;      // northing or latitude
  std::optional<double> z;
  bool is_check = false;  // it takes no part, and shows how far the model is off
  std::vector<ControlMark> marks;
};

struct GroundControlFile {
  std::string source;
  // "EPSG:32632", "+proj=...": what the first line says, UTM zones by their code; and "ENU", metres
  // east, north, up of `origin`.
  std::string system;
  std::optional<Geodetic> origin;  // of "ENU"
  std::vector<SurveyedPoint> points;
  std::size_t num_unreadable = 0;  // lines
  std::string first_unreadable;    // "line 12: ..."; empty: none
};

// Reads ground control points as OpenDroneMap writes them (gcp.txt): the first line is the
// coordinate system ("EPSG:25832", "WGS84 UTM 32N", "WGS84", "+proj=...", or "ENU latitude
// longitude altitude" for local metres), each further one "x y z pixel_x pixel_y image [name]
// [...]" between blanks or tabs: one mark in one image. z may be missing, "nan" or "-". Of further
// columns "check" says that the point is a check point. Lines of the same place (and name, where
// they have one) are marks of one point. Lines that begin with # are comments. Lines that make no
// sense are counted and passed over. Throws Error where the file cannot be read, has no coordinate
// system or no point; the message says which line stands in the way.
GroundControlFile ReadGroundControlFile(const std::filesystem::path& path);

// Are x and y longitude and latitude on WGS 84, so that nothing has to be projected?
bool IsWgs84(const std::string& system);

}  // namespace mono3d
