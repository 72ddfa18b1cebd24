// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/clamped_int.h"
#include "geometry/angles.h"
#include "image/image_state.h"
#include "image/state_archive.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// About square in a picture of 4:3; some hundred points tell shares of it to a few percent.
constexpr int kCellColumns = 12;
constexpr int kCellRows = 9;
constexpr std::size_t kNumCells = std::size_t{kCellColumns} * kCellRows;

// A point this many times as far away as everything that is seen around its place is hidden. Slopes
// within the nine cells around it stay below that.
constexpr float kHiddenFactor = 1.5F;
// With fewer points around a place they do not show what is there.
constexpr std::size_t kMinNumAround = 5;

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegreesPerRadian;
}

}  // namespace

View::View(const Keyframe& keyframe)
    : keyframe_(keyframe), median_depth_su_(UpperMedianOrZero(keyframe.sparse_depths_su)) {
  TakePoints();
}

std::size_t View::CellOf(const Eigen::Vector2d& pixel) const {
  const auto cell = [](double place, int size, int num_cells) {
    return static_cast<std::size_t>(ClampedInt((place + 0.5) / size * num_cells, 0, num_cells - 1));
  };
  return cell(pixel.y(), camera().height, kCellRows) * kCellColumns +
         cell(pixel.x(), camera().width, kCellColumns);
}

void View::TakePoints() {
  std::vector<std::vector<float>> depths(kNumCells);
  std::vector<Eigen::Vector2d> pixels(kNumCells);
  const bool has_pixels = keyframe_.sparse_pixels.size() == keyframe_.sparse_depths_su.size();
  if (has_pixels) {
    for (std::size_t i = 0; i < keyframe_.sparse_depths_su.size(); ++i) {
      const Eigen::Vector2d pixel = keyframe_.sparse_pixels[i].cast<double>();
      if (!keyframe_.frame.Shows(pixel) || !(keyframe_.sparse_depths_su[i] > 0)) continue;
      const std::size_t cell = CellOf(pixel);
      // Where the cell's points are on average.
      pixels[cell] = depths[cell].empty() ? pixel : Eigen::Vector2d(0.5 * (pixels[cell] + pixel));
      depths[cell].push_back(keyframe_.sparse_depths_su[i]);
    }
  } else if (median_depth_su_ > 0) {
    for (std::size_t cell = 0; cell < kNumCells; ++cell) {
      depths[cell].push_back(static_cast<float>(median_depth_su_));
      pixels[cell] = {(double(cell % kCellColumns) + 0.5) / kCellColumns * camera().width - 0.5,
                      (double(cell / kCellColumns) + 0.5) / kCellRows * camera().height - 0.5};
    }
  }
  for (std::size_t cell = 0; cell < kNumCells; ++cell) {
    if (depths[cell].empty()) continue;
    points_.push_back(double(UpperMedian(depths[cell])) * camera().Unproject(pixels[cell]));
  }
  farthest_su_.assign(kNumCells, std::numeric_limits<float>::infinity());
  if (has_pixels) FindFarthest(depths);
}

void View::FindFarthest(const std::vector<std::vector<float>>& depths_of_cell) {
  for (int row = 0; row < kCellRows; ++row) {
    for (int column = 0; column < kCellColumns; ++column) {
      float farthest = 0;
      std::size_t num_points = 0;
      for (int y = std::max(0, row - 1); y <= std::min(kCellRows - 1, row + 1); ++y) {
        for (int x = std::max(0, column - 1); x <= std::min(kCellColumns - 1, column + 1); ++x) {
          const auto& depths = depths_of_cell[static_cast<std::size_t>(y * kCellColumns + x)];
          num_points += depths.size();
          for (const float depth : depths) farthest = std::max(farthest, depth);
        }
      }
      if (num_points < kMinNumAround) continue;
      farthest_su_[static_cast<std::size_t>(row * kCellColumns + column)] = farthest;
    }
  }
}

bool View::Sees(const Eigen::Vector3d& p_cam) const {
  if (!(p_cam.z() > 0)) return false;
  const Eigen::Vector2d pixel = camera().Project(p_cam);
  if (!keyframe_.frame.Shows(pixel)) return false;
  return static_cast<float>(p_cam.z()) <= kHiddenFactor * farthest_su_[CellOf(pixel)];
}

void View::ReleaseImageAndPoints() {
  keyframe_.frame.bgr.release();
  keyframe_.sparse_depths_su = {};
  keyframe_.sparse_pixels = {};
  points_ = {};
}

template <typename Archive>
void View::ExchangeState(Archive& archive) {
  mono3d::ExchangeState(archive, keyframe_);
  archive.Number(median_depth_su_);
  archive.List(points_, [&](Eigen::Vector3d& point) { ExchangeElements(archive, point); });
  archive.List(farthest_su_, [&](float& depth) { archive.AnyNumber(depth); });
  if constexpr (Archive::kReads) {
    const auto is_in_front = [](const Eigen::Vector3d& point) { return point.z() > 0; };
    if (farthest_su_.size() != kNumCells || !(median_depth_su_ >= 0) ||
        !std::ranges::all_of(points_, is_in_front)) {
      archive.Refuse("contradicts itself");
    }
  }
}

template void View::ExchangeState(StateWriter&);
template void View::ExchangeState(StateReader&);

double BaselineRatio(const View& a, const View& b, const KeyframePoses& poses) {
  const Similarity& S_world_a = poses.At(a.id()).S_world_kf;
  const Similarity& S_world_b = poses.At(b.id()).S_world_kf;
  const double median_depth =
      0.5 * (S_world_a.scale() * a.median_depth_su() + S_world_b.scale() * b.median_depth_su());
  return (S_world_a.pose().translation() - S_world_b.pose().translation()).norm() / median_depth;
}

bool AreInOneMap(const View& a, const View& b, const KeyframePoses& poses) {
  const KeyframePose* pose_a = poses.Find(a.id());
  const KeyframePose* pose_b = poses.Find(b.id());
  return pose_a != nullptr && pose_b != nullptr && pose_a->map_id == pose_b->map_id;
}

Reprojection::Reprojection(const View& reference, const View& other, const KeyframePoses& poses)
    : other_(other),
      S_ref_other_(poses.At(reference.id()).S_world_kf.Inverse() * poses.At(other.id()).S_world_kf),
      S_other_ref_(S_ref_other_.Inverse()),
      size_(other.camera().fx / reference.camera().fx * S_other_ref_.scale()) {}

std::optional<double> Reprojection::Scale(const Eigen::Vector3d& p_ref) const {
  const Eigen::Vector3d p_other = S_other_ref_ * p_ref;
  if (!other_.Sees(p_other)) return std::nullopt;
  return size_ * p_ref.z() / p_other.z();
}

CommonView Compare(const View& reference, const View& other, const KeyframePoses& poses) {
  const Reprojection reprojection(reference, other, poses);
  const Pose& T_ref_other = reprojection.S_ref_other().pose();
  CommonView common;
  common.baseline_su = T_ref_other.translation();
  common.baseline_ratio = BaselineRatio(reference, other, poses);
  common.roll_deg = std::abs(QuarterTurnsOf(T_ref_other.rotation()).remainder_deg);
  std::vector<double> scales;
  int num_sharp = 0;
  for (const Eigen::Vector3d& p_ref : reference.points()) {
    const std::optional<double> scale = reprojection.Scale(p_ref);
    if (!scale) continue;
    common.angles_deg.push_back(AngleBetween(p_ref, p_ref - common.baseline_su));
    scales.push_back(*scale);
    num_sharp += *scale >= kMinSharpScale ? 1 : 0;
  }
  if (scales.empty()) return common;
  const auto num_points = static_cast<double>(reference.points().size());
  common.share = static_cast<double>(scales.size()) / num_points;
  common.sharp_share = num_sharp / num_points;
  common.angle_deg = UpperMedian(common.angles_deg);
  common.scale = UpperMedian(std::move(scales));
  return common;
}

}  // namespace mono3d
