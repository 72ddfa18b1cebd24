// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/ground_control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/printable.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/products/coordinate_system.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

// WGS 84 from the coordinates of a file; heights that were not surveyed are those of `height_m`.
class Places {
 public:
  explicit Places(const GroundControlFile& file) : file_(file), definition_(file.system) {
    // Else PROJ takes it for an operation.
    const bool is_text = definition_.starts_with('+');
    if (is_text && definition_.find("+type=") == std::string::npos) definition_ += " +type=crs";
    for (const SurveyedPoint& point : file.points) {
      if (point.z) height_m_ = *point.z;
      if (point.z) break;
    }
    if (file.origin || IsWgs84(file.system)) return;
    const Eigen::Vector3d first = Coordinates(file.points.front());
    rough_ = CoordinateSystem::PlaceOf(definition_, first);
    if (CoordinateSystem::IsProjected(definition_)) {
      system_.emplace(definition_, rough_, /*is_altitude_known=*/true);
    }
  }

  // Heights above the ellipsoid, and not above a sea that nobody has named?
  bool HasAltitude() const { return system_ ? system_->has_heights() : true; }

  Geodetic Of(const SurveyedPoint& point) const {
    const Eigen::Vector3d p = Coordinates(point);
    if (file_.origin) return ToGeodetic(p, *file_.origin);
    if (system_) return ToGeodetic(system_->ToEnu(p), rough_);
    if (!IsWgs84(file_.system)) return CoordinateSystem::PlaceOf(definition_, p);
    if (std::abs(p.x()) > 180 || std::abs(p.y()) > 90) {
      throw Error(ErrorParts{.what = "a ground control point is not on earth",
                             .where = file_.source + ": " + point.name,
                             .expected = "longitude latitude height (" + file_.system + ")",
                             .found = std::to_string(p.x()) + " " + std::to_string(p.y())});
    }
    return {p.y(), p.x(), p.z()};
  }

 private:
  Eigen::Vector3d Coordinates(const SurveyedPoint& point) const {
    return {point.x, point.y, point.z.value_or(height_m_)};
  }

  const GroundControlFile& file_;
  std::string definition_;
  double height_m_ = 0;
  Geodetic rough_;
  std::optional<CoordinateSystem> system_;
};

std::set<std::string> NamesOf(const std::string& list) {
  std::set<std::string> names;
  std::istringstream stream(list);
  for (std::string name; std::getline(stream, name, ',');) {
    if (!name.empty()) names.insert(name);
  }
  return names;
}

std::string Lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

// Images by their file names, whatever the case of the ending.
class ImagesByName {
 public:
  explicit ImagesByName(const std::string& input) {
    std::int64_t index = 0;
    for (const std::string& image : ListImages(input)) {
      const fs::path name = fs::path(image).filename();
      exact_.emplace(name.string(), index);
      loose_.emplace(Loose(name), index);
      ++index;
    }
  }

  std::optional<std::int64_t> IndexOf(const std::string& name) const {
    if (const auto found = exact_.find(name); found != exact_.end()) return found->second;
    const auto found = loose_.find(Loose(name));
    return found == loose_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  static std::string Loose(const fs::path& name) {
    return name.stem().string() + Lower(name.extension().string());
  }

  std::map<std::string, std::int64_t> exact_;
  std::map<std::string, std::int64_t> loose_;
};

std::string Number(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// "east +1.2, north -0.3, up +2.0 cm, 0.8 px"
std::string OffText(const ControlResidual& residual) {
  const Eigen::Vector3d cm = 100 * residual.enu_m;
  return "east " + Number("%+.1f", cm.x()) + ", north " + Number("%+.1f", cm.y()) +
         (residual.has_height ? ", up " + Number("%+.1f", cm.z()) : "") + " cm, " +
         Number("%.1f px", residual.rms_px);
}

struct RmsOfPoints {
  std::size_t num_points = 0, num_heights = 0, num_marks = 0;
  Eigen::Vector3d squares_m2 = Eigen::Vector3d::Zero();
  double squares_px2 = 0;

  void Add(const ControlResidual& residual) {
    ++num_points;
    num_heights += residual.has_height ? 1 : 0;
    num_marks += residual.num_marks_used;
    squares_m2 += residual.enu_m.cwiseAbs2();
    squares_px2 += static_cast<double>(residual.num_marks_used) * residual.rms_px * residual.rms_px;
  }
  std::string Text() const {
    const auto root = [](double sum, std::size_t count) {
      return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, count)));
    };
    return "east " + Number("%.1f", 100 * root(squares_m2.x(), num_points)) + ", north " +
           Number("%.1f", 100 * root(squares_m2.y(), num_points)) + ", up " +
           Number("%.1f cm", 100 * root(squares_m2.z(), num_heights)) + " (RMS), " +
           Number("%.1f px", root(squares_px2, num_marks));
  }
};

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

void AddGroundControlOptions(CLI::App& app, GroundControlArguments& arguments) {
  app.add_option("--gcp", arguments.file,
                 "ground control points as OpenDroneMap writes them: a line with the coordinate "
                 "system, then x y z pixel_x pixel_y image [name]");
  app.add_option("--check-points", arguments.check_points,
                 "names of ground control points, with commas between them, that take no part and "
                 "show how far the model is off");
}

std::optional<GroundControl> ReadGroundControl(const GroundControlArguments& arguments) {
  if (arguments.file.empty()) {
    if (!arguments.check_points.empty()) throw UsageError("--check-points needs --gcp");
    return std::nullopt;
  }
  const GroundControlFile file = ReadGroundControlFile(arguments.file);
  std::set<std::string> check = NamesOf(arguments.check_points);
  const Places places(file);
  GroundControl control;
  control.source = file.source;
  control.has_altitude = places.HasAltitude();
  control.options = arguments.options;
  for (const SurveyedPoint& surveyed : file.points) {
    ControlPoint& point = control.points.emplace_back();
    point.name = surveyed.name;
    point.place = places.Of(surveyed);
    point.has_height = surveyed.z.has_value();
    point.is_check = check.erase(surveyed.name) > 0 || surveyed.is_check;
    for (const ControlMark& mark : surveyed.marks) {
      ControlSight& sight = point.sights.emplace_back();
      sight.image = mark.image;
      sight.pixel = mark.pixel;
    }
  }
  if (!check.empty()) {
    throw UsageError(ErrorParts{.what = "there is no ground control point of this name",
                                .where = "--check-points " + *check.begin(),
                                .expected = "one of those in " + arguments.file,
                                .found = {}});
  }
  if (file.num_unreadable > 0) {
    Log(LogLevel::kWarning,
        Printable(file.source) + ": " + std::to_string(file.num_unreadable) +
            " lines are passed over, the first: " + Printable(file.first_unreadable));
  }
  return control;
}

void FindSights(const std::string& input, const CamerasOfImages& cameras, bool are_frames,
                GroundControl& control) {
  std::error_code ignored;
  if (fs::is_regular_file(input, ignored)) {
    throw UsageError(ErrorParts{.what = "ground control points are marked in images with a name",
                                .where = "--gcp",
                                .expected = "a folder of images or a glob",
                                .found = input});
  }
  const ImagesByName images(input);
  std::size_t num_marks = 0;
  std::vector<std::string> missing;
  for (ControlPoint& point : control.points) {
    std::vector<ControlSight> sights;
    for (ControlSight& sight : point.sights) {
      const std::optional<std::int64_t> index = images.IndexOf(sight.image);
      if (!index) {
        if (std::ranges::count(missing, sight.image) == 0) missing.push_back(sight.image);
        continue;
      }
      const CameraModel& camera = cameras.cameras.at(cameras.Of(*index));
      constexpr double kHalfPixel = 0.5;
      const std::optional<Eigen::Vector3d> ray = camera.Contains(sight.pixel, -kHalfPixel)
                                                     ? UnprojectDistorted(camera, sight.pixel)
                                                     : std::nullopt;
      if (!ray) {
        Log(LogLevel::kWarning, Printable(point.name) + ": its mark in " + Printable(sight.image) +
                                    " lies outside the image");
        continue;
      }
      sight.frame_index = *index;
      sight.ray_cam = *ray;
      sight.focal_px = std::sqrt(camera.fx * camera.fy);
      if (are_frames) {
        sight.line_s =
            camera.shutter.readout_s * LineShare(camera, sight.pixel, camera.shutter.reads_columns);
      }
      sights.push_back(sight);
      ++num_marks;
    }
    point.sights = std::move(sights);
  }
  if (!missing.empty()) {
    Log(LogLevel::kWarning, "ground control: " + std::to_string(missing.size()) +
                                " images are not among those of the input, such as " +
                                Printable(missing.front()));
  }
  const auto num_check = static_cast<std::size_t>(
      std::ranges::count_if(control.points, [](const ControlPoint& p) { return p.is_check; }));
  std::printf("ground control: %zu points", control.points.size() - num_check);
  if (num_check > 0) std::printf(" and %zu check points", num_check);
  std::printf(", %zu marks\n", num_marks);
}

std::string GroundControlLines(const MapReconstruction& map) {
  if (!map.georeference || map.georeference->control.empty()) return {};
  const Georeference& georeference = *map.georeference;
  RmsOfPoints used, check;
  std::size_t num_control = 0;
  std::string unused;
  for (const ControlResidual& residual : georeference.control) {
    if (residual.is_used) used.Add(residual);
    if (!residual.is_check) ++num_control;
    if (residual.is_check && residual.is_seen) check.Add(residual);
    const std::string& why = residual.why_unused;
    if (!why.empty() && (residual.is_check || georeference.is_by_control)) {
      unused += "\n  " + Printable(residual.name) + ": " + why;
      if (residual.is_seen) {
        unused += " (" + OffText(residual) + ")";
      }
    }
    if (!residual.contradicting_images.empty()) {
      unused += "\n  " + Printable(residual.name) + ": its mark contradicts the others in " +
                Printable(Joined(residual.contradicting_images));
    }
  }
  std::string lines;
  if (georeference.is_by_control) {
    lines = "ground control: " + std::to_string(used.num_points) + " of " +
            std::to_string(num_control) + " points used, off by " + used.Text();
  } else {
    lines = "ground control is not used: " + georeference.why_no_control;
  }
  if (check.num_points > 0) {
    lines += "\ncheck points: " + std::to_string(check.num_points) + ", off by " + check.Text();
  }
  return lines + unused;
}

}  // namespace mono3d::tools
