// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/next_views_kml.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "mono3d/core/atomic_file.h"
#include "mono3d/geometry/geodetic.h"
#include "report/table.h"

namespace mono3d::tools {
namespace {

// What a ground station draws without delay; a frame between two others tells little.
constexpr std::size_t kMaxPathPoints = 2000;
// Alpha, blue, green, red: those of the page that shows a run.
constexpr const char* kViewColour = "ffa01e96";
constexpr const char* kPathColour = "ffc2783a";

// A place as KML writes it; eight decimals of a degree are a millimetre.
struct KmlPlace {
  KmlPlace(const Eigen::Vector3d& p_enu_m, const Georeference& georeference) {
    const Geodetic place = ToGeodetic(p_enu_m, georeference.origin);
    longitude = FormatFixed(place.longitude_deg, 8);
    latitude = FormatFixed(place.latitude_deg, 8);
    altitude = FormatFixed(place.altitude_m, 2);
  }
  std::string Coordinates() const { return longitude + "," + latitude + "," + altitude; }
  std::string longitude, latitude, altitude;
};

// Heights from take-off are nearest to those above the ground.
std::string AltitudeMode(const Georeference& georeference) {
  return std::string("<altitudeMode>") +
         (georeference.has_altitude ? "absolute" : "relativeToGround") + "</altitudeMode>";
}

// Where a camera looks: 0 is north, 90 east; and 0 straight down, 90 level.
struct Look {
  double heading_deg = 0, tilt_deg = 0;
};

Look LookOf(const Pose& T_enu_cam) {
  const Eigen::Vector3d ahead = T_enu_cam.rotation() * Eigen::Vector3d::UnitZ();
  // Straight down, the heading is that of the upper edge of the image.
  const Eigen::Vector3d top = T_enu_cam.rotation() * -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d& level = std::hypot(ahead.x(), ahead.y()) > 1e-3 ? ahead : top;
  constexpr double kDegree = std::numbers::pi / 180;
  const double heading_deg = std::atan2(level.x(), level.y()) / kDegree;
  return {heading_deg < 0 ? heading_deg + 360 : heading_deg,
          std::acos(std::clamp(-ahead.z(), -1.0, 1.0)) / kDegree};
}

std::string StyleOf(const std::string& id, const char* colour) {
  return "<Style id=\"" + id + "\"><IconStyle><color>" + colour +
         "</color><scale>0.8</scale></IconStyle><LineStyle><color>" + colour +
         "</color><width>3</width></LineStyle></Style>\n";
}

std::string PointOf(const Eigen::Vector3d& p_enu_m, const Georeference& georeference) {
  return "<Point>" + AltitudeMode(georeference) + "<coordinates>" +
         KmlPlace(p_enu_m, georeference).Coordinates() + "</coordinates></Point>\n";
}

std::string LineOf(const std::vector<Eigen::Vector3d>& points_enu_m,
                   const Georeference& georeference) {
  std::string coordinates;
  for (const Eigen::Vector3d& p_enu_m : points_enu_m) {
    coordinates += KmlPlace(p_enu_m, georeference).Coordinates() + "\n";
  }
  return "<LineString>" + AltitudeMode(georeference) + "<coordinates>\n" + coordinates +
         "</coordinates></LineString>\n";
}

std::string DescriptionOf(const NextView& view, const Look& look, const KmlPlace& place,
                          const NextViews& next, const Georeference& georeference) {
  const double down_deg = 90 - look.tilt_deg;
  return std::string(Explanation(view.MainNeed())) + "; gains " +
         FormatPercent(view.Gain() / next.surface_su2, 1) + " of the model; fly at " +
         place.altitude + (georeference.has_altitude ? " m (altitude)" : " m (from take-off)") +
         ", look to " + FormatFixed(look.heading_deg, 0) + " degrees, " +
         FormatFixed(std::abs(down_deg), 0) + (down_deg >= 0 ? " degrees down" : " degrees up");
}

std::string PlacemarkOf(const NextView& view, std::size_t number, const NextViews& next,
                        const Georeference& georeference) {
  const Eigen::Vector3d& position = view.T_world_cam.translation();
  const KmlPlace place(position, georeference);
  const Look look = LookOf(view.T_world_cam);
  return "<Placemark><name>" + std::to_string(number) + "</name><description>" +
         EscapeHtml(DescriptionOf(view, look, place, next, georeference)) + "</description>\n" +
         "<Camera><longitude>" + place.longitude + "</longitude><latitude>" + place.latitude +
         "</latitude><altitude>" + place.altitude + "</altitude><heading>" +
         FormatFixed(look.heading_deg, 2) + "</heading><tilt>" + FormatFixed(look.tilt_deg, 2) +
         "</tilt>" + AltitudeMode(georeference) + "</Camera>\n" +
         "<styleUrl>#view</styleUrl><MultiGeometry>\n" + PointOf(position, georeference) +
         LineOf({position, view.target_world}, georeference) + "</MultiGeometry></Placemark>\n";
}

std::string PlacemarkOfFlight(const MapReconstruction& map, bool is_path) {
  const std::vector<TrajectoryEntry>& frames = map.trajectory;
  const std::size_t step =
      is_path ? std::max<std::size_t>(1, (frames.size() + kMaxPathPoints - 1) / kMaxPathPoints) : 1;
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < frames.size(); i += step) {
    points.push_back(frames[i].T_world_cam.translation());
  }
  if (points.empty()) return {};
  std::string geometry;
  if (is_path && points.size() > 1) {
    geometry = LineOf(points, *map.georeference);
  } else {
    for (const Eigen::Vector3d& point : points) geometry += PointOf(point, *map.georeference);
    geometry = "<MultiGeometry>\n" + geometry + "</MultiGeometry>\n";
  }
  return std::string("<Placemark><name>") + (is_path ? "The flight" : "The photographs") +
         "</name><styleUrl>#flight</styleUrl>\n" + geometry + "</Placemark>\n";
}

}  // namespace

std::string NextViewsKml(const MapReconstruction& map, const NextViews& next, bool is_path) {
  const Georeference& georeference = *map.georeference;
  std::string views;
  for (std::size_t i = 0; i < next.views.size(); ++i) {
    views += PlacemarkOf(next.views[i], i + 1, next, georeference);
  }
  const std::string known =
      "Places have a standard deviation of " +
      FormatFixed(std::hypot(georeference.position_sigma_m.x(), georeference.position_sigma_m.y()),
                  1) +
      (georeference.has_altitude
           ? " m. Heights are those of the drone: above the sea or the ellipsoid."
           : " m. Heights are from take-off, or from the first image where the drone told none, "
             "and drawn as from the ground.");
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n"
         "<name>Where to fly next</name><description>" +
         EscapeHtml(known) + "</description>\n" + StyleOf("view", kViewColour) +
         StyleOf("flight", kPathColour) + "<Folder><name>Views, the best first</name>\n" + views +
         "</Folder>\n" + PlacemarkOfFlight(map, is_path) + "</Document></kml>\n";
}

void WriteNextViewsKml(const std::filesystem::path& folder, const MapReconstruction& map,
                       const NextViews& next, bool is_path) {
  if (!map.georeference) return;
  WriteFileAtomically(folder / "next_views.kml", NextViewsKml(map, next, is_path));
}

}  // namespace mono3d::tools
