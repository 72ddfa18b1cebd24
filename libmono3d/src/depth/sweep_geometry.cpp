// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sweep_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/angles.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// Pixels of the reference at which visibility and motion are sampled: a grid with the corners.
constexpr int kGridColumns = 13;
constexpr int kGridRows = 9;

// Share of the sample at either end that counts as outliers: the nearest and the farthest of a
// tracker's points are the least reliable.
constexpr double kOutlierShare = 0.02;
// About 1 / (2 kOutlierShare): with fewer depths the quantiles are the extremes.
constexpr std::size_t kMinNumDepths = 25;
// Parts of the scene without points may be somewhat nearer or farther: points lie on corners with
// texture, on roofs and ground rather than on the tips of trees. A quarter of the range covers
// that; a tenth of the inverse depth gives a flat scene a range at all.
constexpr double kMarginOfRange = 0.25;
constexpr double kMarginOfInverseDepth = 0.1;

// Depth in a source over depth in the reference. Below it windows are seen at more than twice the
// size and do not match, so that the motion of these pixels does not limit the step between planes:
// a camera next to a plane would otherwise make the steps too small for all others.
constexpr double kMinDepthRatio = 0.5;

// Images are halved less often.
constexpr int kMaxLevel = 15;

template <typename Visit>
void ForEachGridPixel(const PixelBounds& bounds, const Visit& visit) {
  const Eigen::Vector2d extent = bounds.last - bounds.first;
  for (int row = 0; row < kGridRows; ++row) {
    for (int column = 0; column < kGridColumns; ++column) {
      visit(Eigen::Vector3d(bounds.first.x() + double(column) / (kGridColumns - 1) * extent.x(),
                            bounds.first.y() + double(row) / (kGridRows - 1) * extent.y(), 1));
    }
  }
}

bool Sees(const PixelBounds& bounds, const Eigen::Vector3d& at) {
  return at.z() > 0 && bounds.Contain(at.hnormalized());
}

std::vector<PixelBounds> BoundsOfLevels(const Frame& frame) {
  std::vector<PixelBounds> bounds;
  for (int level = 0; level <= kMaxLevel; ++level) {
    bounds.push_back(BoundsOfContent(frame, level));
  }
  return bounds;
}

// Along one axis: from the first pixel to the last, both of the full resolution.
Eigen::Vector2d HalvedSpan(int first, int last, int size, int level) {
  const int halved_size = (size + (1 << level) - 1) >> level;
  const int from = (first + (1 << level) - 1) >> level;
  // The last pixel of a level may be made of the image's border alone.
  const int to = last == size - 1 ? halved_size - 1 : ((last + 1) >> level) - 1;
  return {from, to};
}

void PackBounds(const PixelBounds& bounds, const LevelSize& size, std::vector<float>& packed) {
  const Eigen::Vector2d last =
      bounds.last.cwiseMin(Eigen::Vector2d(size.width_px - 1., size.height_px - 1.));
  for (const double limit : {bounds.first.x(), bounds.first.y(), last.x(), last.y()}) {
    packed.push_back(static_cast<float>(limit));
  }
}

// Every point is behind it.
SourceProjection SeesNothing() {
  return {Eigen::Vector3d(0, 0, -1).asDiagonal(), Eigen::Vector3d::Zero()};
}

}  // namespace

PixelBounds BoundsOfContent(const Frame& frame, int level) {
  const cv::Rect content = frame.ContentOrAll();
  const Eigen::Vector2d x = HalvedSpan(content.x, content.br().x - 1, frame.camera.width, level);
  const Eigen::Vector2d y = HalvedSpan(content.y, content.br().y - 1, frame.camera.height, level);
  return {{x[0], y[0]}, {x[1], y[1]}};
}

std::vector<std::optional<std::size_t>> IndicesOfSources(const ImageBundle& bundle) {
  const std::size_t reference = bundle.reference_index();
  const std::size_t after = bundle.keyframes.size() - 1 - reference;
  const std::size_t per_side = std::max(reference, after);
  std::vector<std::optional<std::size_t>> indices(2 * per_side);
  for (std::size_t i = 0; i < reference; ++i) indices[i] = i;
  for (std::size_t i = 0; i < after; ++i) indices[per_side + i] = reference + 1 + i;
  return indices;
}

CameraModel HalvedCamera(CameraModel camera, int level) {
  for (int i = 0; i < level; ++i) {
    camera.width = (camera.width + 1) / 2;
    camera.height = (camera.height + 1) / 2;
    camera.fx /= 2;
    camera.fy /= 2;
    camera.cx = (camera.cx + 0.5) / 2 - 0.5;
    camera.cy = (camera.cy + 0.5) / 2 - 0.5;
  }
  return camera;
}

SweepGeometry::SweepGeometry(const ImageBundle& bundle)
    : camera_(bundle.reference().frame.camera), bounds_(BoundsOfLevels(bundle.reference().frame)) {
  for (const std::optional<std::size_t> i : IndicesOfSources(bundle)) {
    if (!i) {
      projections_.push_back(SeesNothing());
      source_cameras_.push_back(camera_);
      source_bounds_.push_back(bounds_);
      continue;
    }
    const Keyframe& keyframe = bundle.keyframes[*i];
    const Pose T_src_ref = bundle.T_ref_cam[*i].Inverse();
    const Eigen::Matrix3d K_src = keyframe.frame.camera.Matrix();
    projections_.push_back(
        {K_src * T_src_ref.rotation().toRotationMatrix() * camera_.Matrix().inverse(),
         K_src * T_src_ref.translation()});
    source_cameras_.push_back(keyframe.frame.camera);
    source_bounds_.push_back(BoundsOfLevels(keyframe.frame));
    projections_.back().bounds = source_bounds_.back().front();
    projections_.back().quarter_turns = QuarterTurnsOf(T_src_ref.rotation()).num;
    largest_baseline_su_ = std::max(largest_baseline_su_, T_src_ref.translation().norm());
  }
}

SourceProjections SweepGeometry::Projections(int level) const {
  SourceProjections result = projections_;
  const Eigen::Matrix3d K = camera_.Matrix();
  const Eigen::Matrix3d K_level = HalvedCamera(camera_, level).Matrix();
  for (std::size_t i = 0; i < projections_.size(); ++i) {
    const Eigen::Matrix3d to_level =
        HalvedCamera(source_cameras_[i], level).Matrix() * source_cameras_[i].Matrix().inverse();
    result[i].A = to_level * projections_[i].A * K * K_level.inverse();
    result[i].b = to_level * projections_[i].b;
    result[i].bounds = source_bounds_[i][static_cast<std::size_t>(level)];
    result[i].reference = bounds(level);
  }
  return result;
}

double SweepGeometry::VisibleShare(double inverse_depth) const {
  int most = 0;
  for (std::size_t i = 0; i < projections_.size(); ++i) {
    int num_seen = 0;
    ForEachGridPixel(bounds(0), [&](const Eigen::Vector3d& p) {
      num_seen += projections_[i].Sees(p.head<2>(), inverse_depth) ? 1 : 0;
    });
    most = std::max(most, num_seen);
  }
  return double(most) / (kGridColumns * kGridRows);
}

double SweepGeometry::PixelsPerInverseDepth(const InverseDepthRange& range) const {
  double fastest = 0;
  for (const double w : {range.farthest, 0.5 * (range.farthest + range.nearest), range.nearest}) {
    for (std::size_t i = 0; i < projections_.size(); ++i) {
      const Eigen::Vector3d& b = projections_[i].b;
      ForEachGridPixel(bounds(0), [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3d at = projections_[i].A * p + w * b;
        if (at.z() < kMinDepthRatio || !Sees(projections_[i].bounds, at)) return;
        const Eigen::Vector2d motion = (b.head<2>() - b.z() * at.hnormalized()) / at.z();
        fastest = std::max(fastest, motion.norm());
      });
    }
  }
  return fastest;
}

std::optional<InverseDepthRange> SweepGeometry::WidestRange() const {
  const double pixels_at_infinity = PixelsPerInverseDepth({0, 0});
  if (!HasBaseline()) return std::nullopt;
  // From 1/8 px of motion on, in steps of a tenth; beyond 1e5 px nothing is in view.
  const double px =
      pixels_at_infinity > 0 ? 1 / pixels_at_infinity : 1 / (camera_.fx * largest_baseline_su_);
  double nearest = 0;
  for (double motion_px = 0.125; motion_px < 1e5; motion_px *= 1.1) {
    if (VisibleShare(motion_px * px) >= 0.5) nearest = motion_px * px;
  }
  if (nearest <= 0) return std::nullopt;
  return InverseDepthRange{0, nearest};
}

std::vector<float> Pack(const SourceProjections& projections, const LevelSize& size) {
  std::vector<float> packed;
  PackBounds(projections.front().reference, size, packed);
  for (const SourceProjection& projection : projections) {
    for (int i = 0; i < 9; ++i) packed.push_back(static_cast<float>(projection.A(i / 3, i % 3)));
    for (int i = 0; i < 3; ++i) packed.push_back(static_cast<float>(projection.b(i)));
    PackBounds(projection.bounds, size, packed);
  }
  return packed;
}

std::uint32_t PackQuarterTurns(const SourceProjections& projections) {
  std::uint32_t packed = 0;
  for (std::size_t i = 0; i < projections.size(); ++i) {
    packed |= projections[i].quarter_turns << (2 * (i + 1));
  }
  return packed;
}

std::optional<InverseDepthRange> RangeOfDepths(const std::vector<float>& depths_su) {
  std::vector<double> inverse;
  for (const float depth : depths_su) {
    if (std::isfinite(depth) && depth > 0) inverse.push_back(1.0 / double(depth));
  }
  if (inverse.size() < kMinNumDepths) return std::nullopt;
  const double farthest = Quantile(inverse, kOutlierShare);
  const double middle = Quantile(inverse, 0.5);
  const double nearest = Quantile(std::move(inverse), 1 - kOutlierShare);
  const double margin = kMarginOfRange * (nearest - farthest) + kMarginOfInverseDepth * middle;
  return InverseDepthRange{std::max(0.0, farthest - margin), nearest + margin};
}

}  // namespace mono3d
