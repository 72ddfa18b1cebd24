// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/direction_points.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "mono3d/core/statistics.h"
#include "tracking/alignment/image_cells.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/map/depth_uncertainty.h"

namespace mono3d::tracking {
namespace {

// Of the median depth: what turning on the spot leaves of a baseline, and what triangulation needs
// at least (1.1 degrees).
constexpr double kMaxTurnBaseline = 0.02;

std::optional<KeyframeId> KeyframeBefore(const Map& map, KeyframeId keyframe) {
  for (KeyframeId id = keyframe; id-- > 0;) {
    if (map.keyframe(id).alive) return id;
  }
  return std::nullopt;
}

// By an angle that is no passing jerk of a hand, whose next image may well have a baseline.
bool TurnsOnTheSpot(const Map& map, KeyframeId keyframe, double median_su) {
  constexpr double kMinTurn_rad = 8 * std::numbers::pi / 180;  // two keyframes by rotation
  const Pose T_world_now = map.keyframe(keyframe).view.T_cam_world.Inverse();
  for (std::optional<KeyframeId> id = KeyframeBefore(map, keyframe); id;
       id = KeyframeBefore(map, *id)) {
    const Pose T_before_now = map.keyframe(*id).view.T_cam_world * T_world_now;
    if (T_before_now.translation().norm() >= kMaxTurnBaseline * median_su) return false;
    if (T_before_now.RotationAngle() > kMinTurn_rad) return true;
  }
  return false;
}

// The inverse depth of what the keyframe sees, affine in the pixel as on a plane. Robust: houses
// stand on it.
class SeenDepthPlane {
 public:
  SeenDepthPlane(const Map& map, const View& view) : camera_(map.camera()) {
    std::vector<Sample> samples;
    std::vector<double> values;
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      if (!view.points[i]) continue;
      const MapPoint& point = map.point(*view.points[i]);
      const double z = (view.T_cam_world * point.p_world).z();
      if (z <= 0) continue;
      constexpr double kRelief = 0.1;  // of what is no plane, as a share of the depth
      samples.push_back({RowOf(view.features[i].pixel), 1 / z,
                         1 / (kRelief * kRelief + point.depth_sigma * point.depth_sigma)});
      values.push_back(1 / z);
    }
    if (values.empty()) return;
    std::sort(values.begin(), values.end());
    const std::size_t twentieth = values.size() / 20;
    lowest_ = values[twentieth] / 2;
    highest_ = values[values.size() - 1 - twentieth] * 2;
    Fit(samples, values[values.size() / 2]);
  }

  // Not beyond twice as far and as near as what is known.
  double At(const Eigen::Vector2d& pixel) const {
    return std::clamp(plane_.dot(RowOf(pixel)), lowest_, highest_);
  }

 private:
  struct Sample {
    Eigen::Vector3d row;
    double inverse_depth = 0;
    double weight = 1;
  };

  Eigen::Vector3d RowOf(const Eigen::Vector2d& pixel) const { return camera_.Unproject(pixel); }

  void Fit(const std::vector<Sample>& samples, double median) {
    plane_ = {0, 0, median};
    constexpr int kRounds = 10;
    for (int round = 0; round < kRounds; ++round) {
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      for (const Sample& sample : samples) {
        const double predicted = std::clamp(plane_.dot(sample.row), lowest_, highest_);
        const double error = (sample.inverse_depth - predicted) / predicted;
        const double weight = sample.weight / (1 + sample.weight * error * error);  // Cauchy
        normal += weight * sample.row * sample.row.transpose();
        right += weight * sample.inverse_depth * sample.row;
      }
      // Few points on one side say little about the slope: a flat one is as good.
      normal.diagonal().head<2>().array() += 1e-2 * normal(2, 2);
      const Eigen::Vector3d plane = normal.ldlt().solve(right);
      if (!plane.allFinite()) return;
      plane_ = plane;
    }
  }

  const CameraModel& camera_;
  Eigen::Vector3d plane_ = Eigen::Vector3d::Zero();
  double lowest_ = 0;
  double highest_ = 0;
};

// Poses of the keyframes that see the same points with a baseline.
std::vector<Pose> ViewsWithBaseline(const Map& map, KeyframeId keyframe, double median_su) {
  std::vector<Pose> views;
  const Eigen::Vector3d centre = map.keyframe(keyframe).view.Centre();
  for (const Covisible& other : map.CovisibleKeyframes(keyframe)) {
    const View& view = map.keyframe(other.keyframe).view;
    if ((view.Centre() - centre).norm() < kMaxTurnBaseline * median_su) continue;
    views.push_back(view.T_cam_world);
  }
  return views;
}

bool IsInView(const CameraModel& camera, const Pose& T_cam_world, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p_cam = T_cam_world * p_world;
  return p_cam.z() > 0 && camera.Contains(camera.Project(p_cam));
}

// The strongest features first, those in cells without a point.
std::vector<std::size_t> FreeFeatures(const Map& map, const View& view, const ImageCells& cells) {
  std::vector<char> is_filled(cells.size(), 0);
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    const Eigen::Vector2d& pixel = view.features[i].pixel;
    if (view.points[i] && map.camera().Contains(pixel)) is_filled[cells.Index(pixel)] = 1;
  }
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    const Eigen::Vector2d& pixel = view.features[i].pixel;
    if (!view.points[i] && map.camera().Contains(pixel) && is_filled[cells.Index(pixel)] == 0) {
      free.push_back(i);
    }
  }
  std::stable_sort(free.begin(), free.end(), [&](std::size_t a, std::size_t b) {
    return view.features[a].response > view.features[b].response;
  });
  return free;
}

}  // namespace

int CreateDirectionPoints(Map& map, KeyframeId keyframe) {
  // A young map rests on few views: its baselines, and so what counts as none, are not yet known.
  constexpr std::size_t kYoung = 5;  // keyframes
  if (map.keyframes().size() < kYoung) return 0;
  const double median = UpperMedianOrZero(map.Depths(map.keyframe(keyframe).view));
  if (median <= 0 || !TurnsOnTheSpot(map, keyframe, median)) return 0;
  const CameraModel& camera = map.camera();
  const ImageCells cells(camera);
  const SeenDepthPlane plane(map, map.keyframe(keyframe).view);
  const std::vector<Pose> others = ViewsWithBaseline(map, keyframe, median);
  const Pose T_world_cam = map.keyframe(keyframe).view.T_cam_world.Inverse();
  constexpr char kMaxPerCell = 2;  // one of them may not be found again
  std::vector<char> num_in_cell(cells.size(), 0);
  int num_created = 0;
  for (const std::size_t i : FreeFeatures(map, map.keyframe(keyframe).view, cells)) {
    View& view = map.keyframe(keyframe).view;
    const Eigen::Vector2d pixel = view.features[i].pixel;
    char& in_cell = num_in_cell[cells.Index(pixel)];
    if (in_cell >= kMaxPerCell) continue;
    const Eigen::Vector3d ray = camera.Unproject(pixel) / plane.At(pixel);
    const Eigen::Vector3d p_cam =
        view.shutter.IsStill() ? ray
                               : Eigen::Vector3d(view.shutter.T_line_cam(ray).Inverse() * ray);
    const Eigen::Vector3d p_world = T_world_cam * p_cam;
    if (std::any_of(others.begin(), others.end(),
                    [&](const Pose& T) { return IsInView(camera, T, p_world); })) {
      continue;
    }
    const PointId point = map.AddPoint(p_world);
    map.point(point).depth_sigma = kGuessedDepthSigma;
    map.AddObservation(point, {keyframe, i});
    map.UpdatePoint(point);
    if (!TakePatchOf(map, point, keyframe, view.features[i])) {
      map.RemovePoint(point);
      continue;
    }
    // The patch says what the point is: others find it to a fraction of a pixel of that.
    constexpr double kSigma_px = 0.1;
    view.features[i].sigma_px = kSigma_px * std::ldexp(1.0, map.point(point).patch->octave);
    ++in_cell;
    ++num_created;
  }
  return num_created;
}

}  // namespace mono3d::tracking
