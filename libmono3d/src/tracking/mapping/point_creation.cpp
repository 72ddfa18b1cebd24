// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/point_creation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/geometry/fundamental.h"
#include "mono3d/geometry/triangulation.h"
#include "mono3d/image/keyframe.h"
#include "tracking/alignment/image_cells.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/features/descriptor.h"
#include "tracking/features/feature_grid.h"
#include "tracking/features/matching.h"
#include "tracking/features/pyramid_scales.h"
#include "tracking/map/point_set.h"
#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

// Rays closer to parallel than this give a depth that says nothing (0.6 degrees; at 1 px and a
// focal length of 700 px the depth error is 15 %).
constexpr double kMaxCosParallax = 0.99995;

struct KeyframePair {
  Map& map;
  KeyframeId a;
  KeyframeId b;
  Pose T_b_a;
  Eigen::Matrix3d F;
  double near_su;  // depths in view of a at which points are searched for
  double far_su;
  double median_su;
  const FeatureGrid& free_b;  // the features of b without a point

  const View& view_a() const { return map.keyframe(a).view; }
  const View& view_b() const { return map.keyframe(b).view; }
  // Of the distance that the epipolar line is: along it an error of the depth moves the pixel.
  Eigen::Vector2d AtMiddleLine(const View& view, const Eigen::Vector2d& pixel) const {
    if (view.shutter.IsStill()) return pixel;
    const CameraModel& camera = map.camera();
    return view.shutter.AtMiddleLine(camera, pixel, median_su * camera.Unproject(pixel));
  }
  double SquaredDistance(const Eigen::Vector2d& pixel_a, const Eigen::Vector2d& pixel_b) const {
    return SquaredEpipolarDistance(F, AtMiddleLine(view_a(), pixel_a),
                                   AtMiddleLine(view_b(), pixel_b));
  }
  // In the frame of a at its middle line.
  std::optional<Eigen::Vector3d> TriangulatePixels(const Eigen::Vector2d& pixel_a,
                                                   const Eigen::Vector2d& pixel_b) const {
    const Eigen::Vector3d ray_a = map.camera().Unproject(pixel_a);
    const Eigen::Vector3d ray_b = map.camera().Unproject(pixel_b);
    if (view_a().shutter.IsStill() && view_b().shutter.IsStill()) {
      return Triangulate(ray_a, ray_b, T_b_a);
    }
    const Pose T_a_line = view_a().shutter.T_line_cam(ray_a).Inverse();
    const std::optional<Eigen::Vector3d> p_line =
        Triangulate(ray_a, ray_b, view_b().shutter.T_line_cam(ray_b) * T_b_a * T_a_line);
    if (!p_line) return std::nullopt;
    return T_a_line * *p_line;
  }
};

// The feature of b along the epipolar line that looks most like feature `i` of a.
std::optional<std::size_t> SearchEpipolarLine(const KeyframePair& pair, std::size_t i,
                                              std::vector<std::size_t>& found) {
  const CameraModel& camera = pair.map.camera();
  const Feature& feature = pair.view_a().features[i];
  const Eigen::Vector3d ray = camera.Unproject(pair.AtMiddleLine(pair.view_a(), feature.pixel));
  const Eigen::Vector3d near_b = pair.T_b_a * (pair.near_su * ray);
  const Eigen::Vector3d far_b = pair.T_b_a * (pair.far_su * ray);
  if (near_b.z() <= 0 || far_b.z() <= 0) return std::nullopt;
  const Eigen::Vector2d first = pair.view_b().shutter.Project(camera, near_b);
  const Eigen::Vector2d last = pair.view_b().shutter.Project(camera, far_b);
  // A line longer than the images says that the depths are off.
  const double length = (last - first).norm();
  if (!(length <= 2.0 * (camera.width + camera.height))) return std::nullopt;
  const PyramidScales& scales = pair.map.scales();
  const int max_level = std::min(feature.level + 1, scales.num_levels() - 1);
  const double radius = std::sqrt(kChi2OneDof * scales.Variance(max_level));
  found.clear();
  pair.free_b.FindAlong({first, last, radius, feature.level - 1, max_level}, found);
  std::optional<std::size_t> best;
  int best_distance = kCloseDistance + 1;
  for (const std::size_t j : found) {
    if (pair.view_b().points[j]) continue;
    const Feature& other = pair.view_b().features[j];
    const double error = pair.SquaredDistance(feature.pixel, other.pixel);
    if (error > kChi2OneDof * pair.map.scales().Variance(other.level)) continue;
    const int distance = Distance(feature.descriptor, other.descriptor);
    if (distance >= best_distance) continue;
    best_distance = distance;
    best = j;
  }
  return best;
}

// The point of two features in the frame of a, if it passes the tests.
std::optional<Eigen::Vector3d> TriangulateChecked(const KeyframePair& pair, const Feature& in_a,
                                                  const Feature& in_b) {
  const CameraModel& camera = pair.map.camera();
  const PyramidScales& scales = pair.map.scales();
  const Eigen::Vector3d ray_a = camera.Unproject(in_a.pixel);
  const Eigen::Vector3d ray_b = camera.Unproject(in_b.pixel);
  const Eigen::Vector3d ray_b_in_a = pair.T_b_a.rotation().conjugate() * ray_b;
  if (ray_a.normalized().dot(ray_b_in_a.normalized()) > kMaxCosParallax) return std::nullopt;
  const std::optional<Eigen::Vector3d> p_a = pair.TriangulatePixels(in_a.pixel, in_b.pixel);
  if (!p_a) return std::nullopt;
  const Eigen::Vector3d p_b = pair.T_b_a * *p_a;
  if (p_a->z() <= 0 || p_b.z() <= 0) return std::nullopt;
  if (!ShowsAt(camera, pair.view_a(), *p_a, in_a)) return std::nullopt;
  if (!ShowsAt(camera, pair.view_b(), p_b, in_b)) return std::nullopt;
  // The ratio of the distances and of the levels say the same, but for half a level on each side
  // and some slant: a factor of 1.5 levels.
  const double by_distance = p_b.norm() / p_a->norm();
  const double by_level = scales.Scale(in_a.level) / scales.Scale(in_b.level);
  const double tolerance = 1.5 * scales.factor();
  if (by_distance * tolerance < by_level || by_distance > by_level * tolerance) return std::nullopt;
  return p_a;
}

// Gives the new point its patch from a and its position in b to a fraction of a pixel. Where the
// images are there, a point that cannot be aligned is none.
bool RefineByPatchAlignment(const KeyframePair& pair, PointId point, std::size_t i, std::size_t j,
                            const Pose& T_world_a) {
  Map& map = pair.map;
  Feature& in_a = map.keyframe(pair.a).view.features[i];
  Feature& in_b = map.keyframe(pair.b).view.features[j];
  if (pair.view_b().octaves.empty() || !TakePatchOf(map, point, pair.a, in_a)) return true;
  const std::optional<Feature> found = FindPatch(map, point, pair.view_b(), in_b.pixel);
  if (!found) return false;
  const std::optional<Eigen::Vector3d> p_a = pair.TriangulatePixels(in_a.pixel, found->pixel);
  if (!p_a) return false;
  in_b.pixel = found->pixel;
  in_b.sigma_px = found->sigma_px;
  in_a.sigma_px = found->sigma_px;
  map.point(point).p_world = T_world_a * *p_a;
  return true;
}

// Features of a keyframe that are a known point, detected anew: to a pixel of its level, one shows
// there that three keyframes or more have seen. As points of their own they would be in the map
// once more with every visit.
std::vector<char> FindKnown(const Map& map, KeyframeId keyframe) {
  constexpr double kSame_px = 1;
  const View& view = map.keyframe(keyframe).view;
  const FeatureGrid without_point(view.features, map.camera().width, map.camera().height,
                                  [&](std::size_t i) { return !view.points[i].has_value(); });
  std::vector<char> is_known(view.features.size(), 0);
  PointSet listed(map);
  std::vector<std::size_t> found;
  for (const Covisible& other : map.CovisibleKeyframes(keyframe)) {
    for (const std::optional<PointId>& point : map.keyframe(other.keyframe).view.points) {
      if (!point || !listed.Insert(*point)) continue;
      if (map.point(*point).observations.size() < kMinConfirmedObservations) continue;
      const std::optional<ProjectedPoint> at = ProjectMapPoint(map, *point, view);
      if (!at) continue;
      const int level = std::min(at->max_level, map.scales().num_levels() - 1);
      found.clear();
      without_point.Find(at->pixel, kSame_px * map.scales().Scale(level), level - 1, level + 1,
                         found);
      for (const std::size_t i : found) is_known[i] = 1;
    }
  }
  return is_known;
}

// Features in cells where the keyframe shows a point that has proven itself, by more keyframes than
// its probation has: tracking follows one point of a cell. A camera that stays would add one more
// with every visit, and keep the keyframes that it is seen from.
std::vector<char> FindServed(const Map& map, KeyframeId keyframe) {
  constexpr std::size_t kMinObservations = 5;
  const View& view = map.keyframe(keyframe).view;
  const ImageCells cells(map.camera());
  std::vector<char> is_cell_served(cells.size(), 0);
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    const std::optional<PointId>& point = view.points[i];
    if (!point || map.point(*point).observations.size() < kMinObservations) continue;
    if (!map.camera().Contains(view.features[i].pixel)) continue;
    is_cell_served[cells.Index(view.features[i].pixel)] = 1;
  }
  std::vector<char> is_served;
  for (const Feature& feature : view.features) {
    const bool is_inside = map.camera().Contains(feature.pixel);
    is_served.push_back(is_inside ? is_cell_served[cells.Index(feature.pixel)] : 0);
  }
  return is_served;
}

int CreateWithNeighbour(const KeyframePair& pair, const std::vector<char>& is_needless) {
  Map& map = pair.map;
  int num_created = 0;
  std::vector<std::size_t> found;
  const Pose T_world_a = pair.view_a().T_cam_world.Inverse();
  for (std::size_t i = 0; i < pair.view_a().features.size(); ++i) {
    if (pair.view_a().points[i] || is_needless[i] != 0) continue;
    const std::optional<std::size_t> j = SearchEpipolarLine(pair, i, found);
    if (!j) continue;
    const std::optional<Eigen::Vector3d> p_a =
        TriangulateChecked(pair, pair.view_a().features[i], pair.view_b().features[*j]);
    if (!p_a) continue;
    const PointId point = map.AddPoint(T_world_a * *p_a);
    map.AddObservation(point, {pair.a, i});
    map.AddObservation(point, {pair.b, *j});
    map.UpdatePoint(point);
    if (RefineByPatchAlignment(pair, point, i, *j, T_world_a)) {
      ++num_created;
    } else {
      map.RemovePoint(point);
    }
  }
  return num_created;
}

bool HasDepth(const Map& map, const View& view, std::size_t feature) {
  return view.points[feature] && map.point(*view.points[feature]).depth_sigma == 0;
}

// Depths around a pixel: on a plane the inverse depth is affine in the pixel.
class LocalSurface {
 public:
  LocalSurface(const Map& map, const View& view)
      : grid_(view.features, map.camera().width, map.camera().height,
              [&](std::size_t i) { return HasDepth(map, view, i); }),
        radius_px_(kRadiusShare * map.camera().width),
        max_level_(map.scales().num_levels() - 1) {
    for (std::size_t i = 0; i < view.features.size(); ++i) {
      double inverse_depth = 0;
      if (HasDepth(map, view, i)) {
        inverse_depth = 1 / (view.T_cam_world * map.point(*view.points[i]).p_world).z();
      }
      known_.emplace_back(view.features[i].pixel.x(), view.features[i].pixel.y(), inverse_depth);
    }
  }

  // Least squares over the points near; nothing where they are too few or in one line.
  std::optional<double> DepthAt(const Eigen::Vector2d& pixel,
                                std::vector<std::size_t>& near) const {
    constexpr std::size_t kMinPoints = 6;  // twice the unknowns
    constexpr double kMinSpread = 1e-3;    // of the smallest eigenvalue by the largest
    near.clear();
    grid_.Find(pixel, radius_px_, 0, max_level_, near);
    if (near.size() < kMinPoints) return std::nullopt;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const std::size_t i : near) {
      const Eigen::Vector2d from = (known_[i].head<2>() - pixel) / radius_px_;
      const Eigen::Vector3d row(from.x(), from.y(), 1);
      normal += row * row.transpose();
      right += known_[i].z() * row;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal);
    if (solver.eigenvalues()[0] < kMinSpread * solver.eigenvalues()[2]) return std::nullopt;
    const double inverse_depth = normal.ldlt().solve(right).z();
    if (!(inverse_depth > 0)) return std::nullopt;
    return 1 / inverse_depth;
  }

 private:
  // Of the image width: few surfaces are flat for longer.
  static constexpr double kRadiusShare = 0.1;
  FeatureGrid grid_;
  double radius_px_;
  int max_level_;
  std::vector<Eigen::Vector3d> known_;  // pixel and inverse depth of each feature with a point
};

// The point of feature `i` of a, from about where it is: its patch is looked for in b.
bool CreateByPatch(const KeyframePair& pair, std::size_t i, const Eigen::Vector3d& guess_a) {
  Map& map = pair.map;
  const Eigen::Vector3d guess_b = pair.T_b_a * guess_a;
  if (guess_b.z() <= 0) return false;
  const Eigen::Vector2d start_px = pair.view_b().shutter.Project(map.camera(), guess_b);
  if (!map.camera().Contains(start_px)) return false;
  const Feature in_a = pair.view_a().features[i];
  const Pose T_world_a = pair.view_a().T_cam_world.Inverse();
  const PointId point = map.AddPoint(T_world_a * guess_a);
  map.AddObservation(point, {pair.a, i});
  map.UpdatePoint(point);
  const auto locate = [&]() -> std::optional<Feature> {
    if (!TakePatchOf(map, point, pair.a, in_a)) return std::nullopt;
    std::optional<Feature> found = FindPatch(map, point, pair.view_b(), start_px);
    // The surface may be another than expected, the line may not.
    if (!found || pair.SquaredDistance(in_a.pixel, found->pixel) > kChi2OneDof) {
      return std::nullopt;
    }
    return found;
  };
  const std::optional<Feature> in_b = locate();
  const std::optional<Eigen::Vector3d> p_a =
      in_b ? TriangulateChecked(pair, in_a, *in_b) : std::nullopt;
  if (!p_a) {
    map.RemovePoint(point);
    return false;
  }
  map.point(point).p_world = T_world_a * *p_a;
  map.keyframe(pair.a).view.features[i].sigma_px = in_b->sigma_px;
  map.AddObservation(point, pair.b, *in_b);
  map.UpdatePoint(point);
  return true;
}

}  // namespace

int CreatePoints(Map& map, KeyframeId keyframe, const LocalMappingOptions& options) {
  std::vector<float> depths = map.Depths(map.keyframe(keyframe).view);
  if (depths.empty()) return 0;
  std::sort(depths.begin(), depths.end());
  const double median = depths[depths.size() / 2];
  // Beyond the depths known there may be more to find, twice as near and four times as far.
  const double near_su = 0.5 * depths[depths.size() / 50];
  const double far_su = 4 * depths[depths.size() - 1 - depths.size() / 50];
  int num_created = 0;
  std::vector<char> is_needless = FindKnown(map, keyframe);
  const std::vector<char> is_served = FindServed(map, keyframe);
  for (std::size_t i = 0; i < is_needless.size(); ++i) is_needless[i] |= is_served[i];
  for (const Covisible& neighbour :
       map.CovisibleKeyframes(keyframe, static_cast<std::size_t>(options.num_neighbours))) {
    const View& a = map.keyframe(keyframe).view;
    const View& b = map.keyframe(neighbour.keyframe).view;
    const Pose T_b_a = b.T_cam_world * a.T_cam_world.Inverse();
    if (T_b_a.translation().norm() < options.min_baseline_share * median) continue;
    const Eigen::Matrix3d K = map.camera().Matrix();
    const Eigen::Matrix3d F = FundamentalFromMotion(T_b_a, K, K);
    const FeatureGrid free_b(b.features, map.camera().width, map.camera().height,
                             [&](std::size_t i) { return !b.points[i].has_value(); });
    num_created += CreateWithNeighbour(
        {map, keyframe, neighbour.keyframe, T_b_a, F, near_su, far_su, median, free_b},
        is_needless);
  }
  return num_created;
}

int CreatePointsByPatches(Map& map, KeyframeId keyframe, const LocalMappingOptions& options) {
  const std::vector<Covisible> neighbours = map.CovisibleKeyframes(keyframe, 1);
  if (neighbours.empty()) return 0;
  const KeyframeId neighbour = neighbours.front().keyframe;
  const View& a = map.keyframe(keyframe).view;
  const View& b = map.keyframe(neighbour).view;
  const Pose T_b_a = b.T_cam_world * a.T_cam_world.Inverse();
  const double median = UpperMedianOrZero(map.Depths(a));
  if (T_b_a.translation().norm() < options.min_baseline_share * median) return 0;
  const Eigen::Matrix3d K = map.camera().Matrix();
  const FeatureGrid unused;
  const KeyframePair pair{map, keyframe, neighbour, T_b_a, FundamentalFromMotion(T_b_a, K, K),
                          0.0, median,   median,    unused};
  const LocalSurface surface(map, a);
  std::vector<std::size_t> near;
  int num_created = 0;
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    if (a.points[i]) continue;
    const std::optional<double> depth = surface.DepthAt(a.features[i].pixel, near);
    if (!depth) continue;
    const Eigen::Vector2d pixel = pair.AtMiddleLine(a, a.features[i].pixel);
    const Eigen::Vector3d guess_a = *depth * map.camera().Unproject(pixel);
    num_created += CreateByPatch(pair, i, guess_a) ? 1 : 0;
  }
  return num_created;
}

}  // namespace mono3d::tracking
