// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/model_view.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "drawing/cloud_view.h"
#include "mono3d/core/statistics.h"
#include "report/base64.h"
#include "report/table.h"
#include "run_report/model_drawing.h"
#include "run_report/model_view_script.h"

namespace mono3d::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

// Surfels farther from the middle than so many radii of the scene are left out.
constexpr double kMaxExtent = 3;
constexpr std::size_t kMaxPathSegments = 3000;

// From the world to the axes of the page: z up, the scene's radius as unit.
struct PageAxes {
  Eigen::Matrix3d R_page_world;
  Eigen::Vector3d centre_world;
  double radius_su = 1;
  Eigen::Vector3d operator()(const Eigen::Vector3d& p_world) const {
    return R_page_world * (p_world - centre_world) / radius_su;
  }
};

PageAxes AxesOfPage(const PointCloud& cloud, const std::optional<Eigen::Vector3d>& up_world) {
  const CloudView above = StandardCloudViews(SampleOf(cloud, 10'000), 1000, up_world).front();
  PageAxes axes;
  axes.R_page_world = above.R_view_world;
  axes.R_page_world.bottomRows<2>() *= -1;
  axes.centre_world = above.centre_world;
  axes.radius_su = 0.5 * above.pixel_su * std::hypot(above.size.width, above.size.height);
  return axes;
}

// Radii as a byte, on a logarithmic scale.
struct RadiusScale {
  double smallest = 1e-4;
  double largest = 1;
  std::uint8_t ToByte(double radius) const {
    const double share =
        std::log(std::max(radius, smallest) / smallest) / std::log(largest / smallest);
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
  }
};

std::int8_t ToSignedByte(double value) {
  return static_cast<std::int8_t>(std::lround(127 * std::clamp(value, -1.0, 1.0)));
}

// The octahedron's two coordinates of a direction.
std::array<std::int8_t, 2> Octahedral(const Eigen::Vector3d& direction) {
  const double sum = direction.cwiseAbs().sum();
  if (!(sum > 0)) return {0, 0};
  double x = direction.x() / sum;
  double y = direction.y() / sum;
  if (direction.z() < 0) {
    const double folded_x = std::copysign(1 - std::abs(y), x);
    y = std::copysign(1 - std::abs(x), y);
    x = folded_x;
  }
  return {ToSignedByte(x), ToSignedByte(y)};
}

struct PackedSurfel {
  std::array<std::uint16_t, 3> position;  // from -kMaxExtent to kMaxExtent
  std::array<std::uint8_t, 3> colour;
  std::uint8_t radius;
  std::array<std::int8_t, 2> normal;
};
static_assert(sizeof(PackedSurfel) == 12, "as the script reads it");

std::vector<PackedSurfel> Pack(const PointCloud& cloud, const PageAxes& axes,
                               const RadiusScale& radii) {
  std::vector<PackedSurfel> packed;
  packed.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d at = axes(cloud.points[i].cast<double>());
    if (!(at.cwiseAbs().maxCoeff() <= kMaxExtent)) continue;
    PackedSurfel surfel{};
    for (int c = 0; c < 3; ++c) {
      const double share = 0.5 * (at[c] / kMaxExtent + 1);
      surfel.position.at(static_cast<std::size_t>(c)) =
          static_cast<std::uint16_t>(std::lround(65535 * share));
    }
    surfel.colour = {150, 150, 150};
    if (!cloud.colours.empty()) surfel.colour = cloud.colours[i];
    surfel.radius = radii.ToByte(cloud.radii[i] / axes.radius_su);
    surfel.normal = Octahedral(axes.R_page_world * cloud.normals[i].cast<double>());
    packed.push_back(surfel);
  }
  return packed;
}

// Pairs of neighbouring positions.
std::vector<float> PathSegments(const MapReconstruction& map, const PageAxes& axes) {
  const std::vector<TrajectoryEntry>& path = map.trajectory;
  const std::size_t step = path.size() / kMaxPathSegments + 1;
  std::vector<float> segments;
  const auto add = [&](std::size_t i) {
    const Eigen::Vector3f at = axes(path[i].T_world_cam.translation()).cast<float>();
    segments.insert(segments.end(), {at.x(), at.y(), at.z()});
  };
  for (std::size_t i = 0; i + step < path.size(); i += step) {
    add(i);
    add(i + step);
  }
  return segments;
}

template <typename Value>
std::string Base64Of(const std::vector<Value>& values) {
  std::vector<std::uint8_t> bytes(values.size() * sizeof(Value));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return ToBase64(bytes);
}

std::string DataHtml(const std::string& id, const std::string& data,
                     const std::string& attributes = {}) {
  return "<script type=\"text/plain\" id=\"" + id + "\"" + attributes + ">" + data + "</script>\n";
}

}  // namespace

std::string ModelViewHtml(const MapReconstruction& map, bool is_path, std::size_t max_surfels) {
  if (map.model.empty() || map.model.normals.empty() || map.model.radii.empty()) return {};
  const PointCloud cloud = SampleOf(map.model, max_surfels);
  const PageAxes axes = AxesOfPage(cloud, KnownUp(map));
  RadiusScale radii;
  radii.largest = Quantile(cloud.radii, 0.99) / axes.radius_su;
  radii.smallest = radii.largest / 1000;
  if (!(radii.largest > 0)) return {};
  const std::vector<PackedSurfel> packed = Pack(cloud, axes, radii);
  const std::string attributes = " data-extent=\"" + FormatNumber(kMaxExtent) +
                                 "\" data-smallest=\"" + FormatNumber(radii.smallest, 6) +
                                 "\" data-ratio=\"1000\"";
  std::string html = kModelViewHtml;
  html += "<p class=\"note\">" + std::to_string(packed.size()) + " of " +
          std::to_string(map.model.size()) +
          " surfels. Drag to turn, with the right button or two fingers to move, wheel or pinch to "
          "zoom, double click to begin again.</p>\n";
  html += DataHtml("surfels", Base64Of(packed), attributes);
  const std::vector<float> path = is_path ? PathSegments(map, axes) : std::vector<float>();
  html += DataHtml("path", Base64Of(path));
  return html + "<script>\n" + kModelViewScript + "</script>\n";
}

}  // namespace mono3d::tools
