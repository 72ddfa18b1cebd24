// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/coordinate_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

#ifdef MONO3D_HAS_PROJ
#include <proj.h>
#endif

namespace mono3d {

std::string UtmCodeOf(const Geodetic& place) {
  const double latitude = place.latitude_deg, longitude = place.longitude_deg;
  if (latitude >= 84) return "EPSG:32661";
  if (latitude < -80) return "EPSG:32761";
  int zone = std::clamp(static_cast<int>(std::floor((longitude + 180) / 6)) + 1, 1, 60);
  if (latitude >= 56 && latitude < 64 && longitude >= 3 && longitude < 12) zone = 32;
  if (latitude >= 72 && longitude >= 0 && longitude < 42) {
    zone = longitude < 9 ? 31 : longitude < 21 ? 33 : longitude < 33 ? 35 : 37;
  }
  const std::string digits = (zone < 10 ? "0" : "") + std::to_string(zone);
  return (latitude >= 0 ? "EPSG:326" : "EPSG:327") + digits;
}

#ifdef MONO3D_HAS_PROJ

namespace {

struct ContextDeleter {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
};
struct ObjectDeleter {
  void operator()(PJ* object) const { proj_destroy(object); }
};
using ContextPtr = std::unique_ptr<PJ_CONTEXT, ContextDeleter>;
using ObjectPtr = std::unique_ptr<PJ, ObjectDeleter>;

// PROJ keeps the last message alone where it is asked to; by itself it prints.
void KeepMessage(void* last_message, int /*level*/, const char* message) {
  *static_cast<std::string*>(last_message) = message;
}

[[noreturn]] void ThrowUnusable(const std::string& definition, const std::string& expected,
                                const std::string& found) {
  throw Error(ErrorParts{.what = "the coordinate system cannot be used",
                         .where = definition,
                         .expected = expected,
                         .found = found,
                         .code = ErrorCode::kInvalidArgument});
}

std::string WktOf(PJ_CONTEXT* context, const PJ* crs, PJ_WKT_TYPE type) {
  const char* const options[] = {"MULTILINE=NO", nullptr};
  const char* text = proj_as_wkt(context, crs, type, options);
  return text != nullptr ? text : "";
}

}  // namespace

struct CoordinateSystem::Projection {
  Geodetic origin;
  std::string last_message;  // of PROJ; before the context, which writes to it
  ContextPtr context;
  ObjectPtr crs;
  ObjectPtr from_geodetic;
  std::string name, wkt2, wkt1;
  bool has_heights = false;
  double metres_per_unit = 1;

  // The projected part of the system. Throws Error where there is none.
  ObjectPtr Horizontal(const std::string& definition) {
    PJ_TYPE type = proj_get_type(crs.get());
    ObjectPtr horizontal(proj_clone(context.get(), crs.get()));
    if (type == PJ_TYPE_COMPOUND_CRS) {
      has_heights = true;
      horizontal.reset(proj_crs_get_sub_crs(context.get(), crs.get(), 0));
      type = proj_get_type(horizontal.get());
    }
    if (type == PJ_TYPE_BOUND_CRS) {
      horizontal.reset(proj_get_source_crs(context.get(), horizontal.get()));
      type = proj_get_type(horizontal.get());
    }
    if (type != PJ_TYPE_PROJECTED_CRS) {
      ThrowUnusable(definition, "a projected one, as a UTM zone is", name);
    }
    return horizontal;
  }

  void ReadUnit(const PJ* horizontal) {
    const ObjectPtr axes(proj_crs_get_coordinate_system(context.get(), horizontal));
    double factor = 1;
    if (axes &&
        proj_cs_get_axis_info(context.get(), axes.get(), 0, nullptr, nullptr, nullptr, &factor,
                              nullptr, nullptr, nullptr) != 0 &&
        factor > 0) {
      metres_per_unit = factor;
    }
  }

  // Null where PROJ has none.
  ObjectPtr Operation(bool may_be_ballpark) const {
    const ObjectPtr wgs84(proj_create(context.get(), "EPSG:4979"));
    PJ_AREA* area = proj_area_create();
    constexpr double kMargin_deg = 0.01;  // the size of a flight
    proj_area_set_bbox(area, origin.longitude_deg - kMargin_deg, origin.latitude_deg - kMargin_deg,
                       origin.longitude_deg + kMargin_deg, origin.latitude_deg + kMargin_deg);
    const char* const options[] = {may_be_ballpark ? nullptr : "ALLOW_BALLPARK=NO", nullptr};
    const ObjectPtr operation(
        proj_create_crs_to_crs_from_pj(context.get(), wgs84.get(), crs.get(), area, options));
    proj_area_destroy(area);
    if (!operation) return nullptr;
    return ObjectPtr(proj_normalize_for_visualization(context.get(), operation.get()));
  }

  void FindOperation(const std::string& definition) {
    from_geodetic = Operation(false);
    if (from_geodetic && IsUsable()) return;
    if (has_heights) {
      ThrowUnusable(definition,
                    "heights that PROJ can bring from WGS 84 into it (install proj-data, or set "
                    "PROJ_NETWORK=ON)",
                    "no grid of them");
    }
    from_geodetic = Operation(true);
    if (!from_geodetic || !IsUsable()) {
      ThrowUnusable(definition, "one that holds where the flight was", "another part of the earth");
    }
    Log(LogLevel::kWarning, definition +
                                ": PROJ knows no exact way from WGS 84 to it: "
                                "places may be off by metres");
  }

  bool IsUsable() const {
    const Eigen::Vector3d there = ToMap(Eigen::Vector3d::Zero());
    return there.allFinite() && ToEnu(there).norm() < 1;
  }

  Eigen::Vector3d ToMap(const Eigen::Vector3d& p_enu_m) const {
    const Geodetic place = ToGeodetic(p_enu_m, origin);
    const PJ_COORD in =
        proj_coord(place.longitude_deg, place.latitude_deg, place.altitude_m, HUGE_VAL);
    const PJ_COORD out = proj_trans(from_geodetic.get(), PJ_FWD, in);
    // Without a vertical system, heights stay above WGS 84, whatever ellipsoid the system has.
    return {out.xyz.x, out.xyz.y, has_heights ? out.xyz.z : place.altitude_m};
  }

  Eigen::Vector3d ToEnu(const Eigen::Vector3d& p_map) const {
    const PJ_COORD in = proj_coord(p_map.x(), p_map.y(), p_map.z(), HUGE_VAL);
    const PJ_COORD out = proj_trans(from_geodetic.get(), PJ_INV, in);
    return mono3d::ToEnu({.latitude_deg = out.lpz.phi,
                          .longitude_deg = out.lpz.lam,
                          .altitude_m = has_heights ? out.lpz.z : p_map.z()},
                         origin);
  }
};

bool CoordinateSystem::IsSupported() { return true; }

namespace {

// A definition that PROJ knows, in a context of its own.
struct KnownSystem {
  std::string last_message;
  ContextPtr context;
  ObjectPtr crs;

  explicit KnownSystem(const std::string& definition) : context(proj_context_create()) {
    proj_log_func(context.get(), &last_message, &KeepMessage);
    crs.reset(proj_create(context.get(), definition.c_str()));
    if (!crs || proj_is_crs(crs.get()) == 0) {
      ThrowUnusable(definition, "a code that PROJ knows, such as EPSG:25832",
                    last_message.empty() ? "none" : last_message);
    }
  }

  // Without the vertical part, and without what it is bound to.
  ObjectPtr Horizontal() const {
    ObjectPtr horizontal(proj_clone(context.get(), crs.get()));
    if (proj_get_type(horizontal.get()) == PJ_TYPE_COMPOUND_CRS) {
      horizontal.reset(proj_crs_get_sub_crs(context.get(), crs.get(), 0));
    }
    if (proj_get_type(horizontal.get()) == PJ_TYPE_BOUND_CRS) {
      horizontal.reset(proj_get_source_crs(context.get(), horizontal.get()));
    }
    return horizontal;
  }

  bool HasHeights() const {
    const PJ_TYPE type = proj_get_type(crs.get());
    return type == PJ_TYPE_COMPOUND_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
  }
};

}  // namespace

bool CoordinateSystem::IsProjected(const std::string& definition) {
  return proj_get_type(KnownSystem(definition).Horizontal().get()) == PJ_TYPE_PROJECTED_CRS;
}

Geodetic CoordinateSystem::PlaceOf(const std::string& definition, const Eigen::Vector3d& p_map) {
  const KnownSystem known(definition);
  PJ_CONTEXT* context = known.context.get();
  const ObjectPtr wgs84(proj_create(context, "EPSG:4979"));
  const ObjectPtr direct(
      proj_create_crs_to_crs_from_pj(context, known.crs.get(), wgs84.get(), nullptr, nullptr));
  const ObjectPtr operation(direct ? proj_normalize_for_visualization(context, direct.get())
                                   : nullptr);
  if (!operation) ThrowUnusable(definition, "one with a way to WGS 84", known.last_message);
  const PJ_COORD in = proj_coord(p_map.x(), p_map.y(), p_map.z(), HUGE_VAL);
  const PJ_COORD out = proj_trans(operation.get(), PJ_FWD, in);
  const Geodetic place = {.latitude_deg = out.lpz.phi,
                          .longitude_deg = out.lpz.lam,
                          .altitude_m = known.HasHeights() ? out.lpz.z : p_map.z()};
  const bool is_place = std::abs(place.latitude_deg) <= 90 &&
                        std::abs(place.longitude_deg) <= 180 && std::isfinite(place.altitude_m);
  if (!is_place) {
    ThrowUnusable(definition, "coordinates that are a place of it",
                  std::to_string(p_map.x()) + " " + std::to_string(p_map.y()));
  }
  return place;
}

CoordinateSystem::CoordinateSystem(const std::string& definition, const Geodetic& origin,
                                   bool is_altitude_known)
    : projection_(std::make_unique<Projection>()) {
  Projection& projection = *projection_;
  projection.origin = origin;
  projection.context.reset(proj_context_create());
  PJ_CONTEXT* context = projection.context.get();
  proj_log_func(context, &projection.last_message, &KeepMessage);
  projection.crs.reset(proj_create(context, definition.c_str()));
  if (!projection.crs || proj_is_crs(projection.crs.get()) == 0) {
    ThrowUnusable(definition, "a code that PROJ knows, such as EPSG:25832",
                  projection.last_message.empty() ? "none" : projection.last_message);
  }
  projection.name = proj_get_name(projection.crs.get());
  const ObjectPtr horizontal = projection.Horizontal(definition);
  if (projection.has_heights && !is_altitude_known) {
    ThrowUnusable(definition,
                  "one without heights: those of the run are as the drone has them, not above the "
                  "ellipsoid",
                  projection.name);
  }
  projection.ReadUnit(horizontal.get());
  projection.FindOperation(definition);
  projection.wkt2 = WktOf(context, projection.crs.get(), PJ_WKT2_2019);
  projection.wkt1 = WktOf(context, projection.crs.get(), PJ_WKT1_GDAL);
  if (projection.wkt1.empty()) projection.wkt1 = projection.wkt2;
}

const std::string& CoordinateSystem::name() const { return projection_->name; }
const std::string& CoordinateSystem::wkt2() const { return projection_->wkt2; }
const std::string& CoordinateSystem::wkt1() const { return projection_->wkt1; }
bool CoordinateSystem::has_heights() const { return projection_->has_heights; }
double CoordinateSystem::metres_per_unit() const { return projection_->metres_per_unit; }

Eigen::Vector3d CoordinateSystem::ToMap(const Eigen::Vector3d& p_enu_m) const {
  return projection_->ToMap(p_enu_m);
}
Eigen::Vector3d CoordinateSystem::ToEnu(const Eigen::Vector3d& p_map) const {
  return projection_->ToEnu(p_map);
}

#else

struct CoordinateSystem::Projection {
  std::string empty;
};

namespace {

[[noreturn]] void ThrowUnsupported(const std::string& definition) {
  throw Error(ErrorParts{.what = "coordinate systems need PROJ",
                         .where = definition,
                         .expected = "a mono3d that was built with libproj-dev",
                         .found = "one without",
                         .code = ErrorCode::kUnsupported});
}

}  // namespace

bool CoordinateSystem::IsSupported() { return false; }
bool CoordinateSystem::IsProjected(const std::string& definition) { ThrowUnsupported(definition); }
Geodetic CoordinateSystem::PlaceOf(const std::string& definition,
                                   const Eigen::Vector3d& /*p_map*/) {
  ThrowUnsupported(definition);
}

CoordinateSystem::CoordinateSystem(const std::string& definition, const Geodetic& /*origin*/,
                                   bool /*is_altitude_known*/) {
  ThrowUnsupported(definition);
}

const std::string& CoordinateSystem::name() const { return projection_->empty; }
const std::string& CoordinateSystem::wkt2() const { return projection_->empty; }
const std::string& CoordinateSystem::wkt1() const { return projection_->empty; }
bool CoordinateSystem::has_heights() const { return false; }
double CoordinateSystem::metres_per_unit() const { return 1; }
Eigen::Vector3d CoordinateSystem::ToMap(const Eigen::Vector3d& p_enu_m) const { return p_enu_m; }
Eigen::Vector3d CoordinateSystem::ToEnu(const Eigen::Vector3d& p_map) const { return p_map; }

#endif

CoordinateSystem::~CoordinateSystem() = default;
CoordinateSystem::CoordinateSystem(CoordinateSystem&&) noexcept = default;
CoordinateSystem& CoordinateSystem::operator=(CoordinateSystem&&) noexcept = default;

}  // namespace mono3d
