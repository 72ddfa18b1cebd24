// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/wanted_places.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <utility>

namespace mono3d {
namespace {

const double kSameSide = std::cos(15 * std::numbers::pi / 180);
const double kOtherSide = std::cos(20 * std::numbers::pi / 180);
constexpr double kFlatAngle = 0.3;   // cosine to the normal, about 73 degrees
constexpr double kGoodAngle = 0.35;  // about 70 degrees
constexpr double kMuchBetterAngle = 0.5;
constexpr double kLowConfidence = 0.3;  // one sure observation is 0.5
// Depth in cells by which a place counts as seen, seen through or hidden.
constexpr double kSeenWithin = 1.5;
constexpr double kSeenThroughBy = 0.5;
constexpr double kHiddenBy = 1.5;
constexpr int kMinHidingViews = 2;
// A ray may slip through between two discs: one view alone does not see through a place.
constexpr int kMinViewsThrough = 2;
constexpr double kMinShareThrough = 0.04;
constexpr int kEnoughViewsThrough = 8;
constexpr int kMinHiddenNeighbours = 3;  // of 26: fewer are noise
// Distances of the flight: what is farther counts less and less.
constexpr double kNear = 1.5, kFar = 2.5;

// How the views saw a cell of the surface.
struct Sight {
  int num_views = 0;
  double best_cosine = 0;
  std::array<Eigen::Vector3d, 2> from = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};

  void Add(const Eigen::Vector3d& towards_camera, double cosine) {
    if (num_views++ == 0) from = {towards_camera, towards_camera};
    best_cosine = std::max(best_cosine, cosine);
    if (from[0].dot(towards_camera) < from[0].dot(from[1])) from[1] = towards_camera;
  }
};

// What is known of cells without a surfel.
struct Space {
  explicit Space(std::size_t num) : num_through(num), num_hiding(num) {}
  // Views: that see through it, kEnoughViewsThrough at most, and that look there in vain, 255 at
  // most.
  std::vector<std::uint8_t> num_through, num_hiding;

  bool IsFree(std::size_t index) const {
    const int num = num_through[index];
    return num >= kEnoughViewsThrough ||
           (num >= kMinViewsThrough && num >= kMinShareThrough * (num + num_hiding[index]));
  }
};

// How the views see the cells. Cells and pictures are independent of each other, so that they are
// shared out among threads.
class Looks {
 public:
  Looks(const CellGrid& grid, std::span<const Pose> views, const CameraModel& camera,
        const Eigen::Vector3d& up)
      : grid_(grid), views_(views) {
    std::vector<std::optional<CellPicture>> drawn(views.size());
    cv::parallel_for_({0, static_cast<int>(views.size())}, [&](const cv::Range& range) {
      for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end);
           ++i) {
        drawn[i].emplace(camera, views[i]);
        drawn[i]->Draw(grid.surface(), grid.cell_su());
        drawn[i]->OpenSky(up);
      }
    });
    for (std::optional<CellPicture>& picture : drawn) pictures_.push_back(*std::move(picture));
  }

  Space AtSpace(double max_depth_su) const {
    Space space(grid_.num_cells());
    cv::parallel_for_({0, grid_.size().z()}, [&](const cv::Range& range) {
      Eigen::Vector3i at;
      for (at.z() = range.start; at.z() < range.end; ++at.z()) {
        for (at.y() = 0; at.y() < grid_.size().y(); ++at.y()) {
          for (at.x() = 0; at.x() < grid_.size().x(); ++at.x()) AtCell(at, max_depth_su, space);
        }
      }
    });
    return space;
  }

  std::vector<Sight> AtSurface() const {
    std::vector<Sight> sights(grid_.surface().size());
    cv::parallel_for_({0, static_cast<int>(sights.size())}, [&](const cv::Range& range) {
      for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end);
           ++i) {
        for (std::size_t view = 0; view < views_.size(); ++view) {
          AtSurfaceCell(grid_.surface()[i], view, sights[i]);
        }
      }
    });
    return sights;
  }

 private:
  void AtCell(const Eigen::Vector3i& at, double max_depth_su, Space& space) const {
    const std::size_t index = grid_.Index(at);
    if (grid_.IsTouched(index)) return;
    const double cell_su = grid_.cell_su();
    const Eigen::Vector3d centre = grid_.Centre(at);
    for (const CellPicture& picture : pictures_) {
      if (space.num_through[index] >= kEnoughViewsThrough) return;
      const CellPicture::Depths depths = picture.At(centre);
      if (depths.point == 0 || depths.point > max_depth_su || !std::isfinite(depths.surface)) {
        continue;
      }
      if (depths.point < depths.surface - kSeenThroughBy * cell_su) ++space.num_through[index];
      if (depths.point > depths.surface + kHiddenBy * cell_su && space.num_hiding[index] < 255) {
        ++space.num_hiding[index];
      }
    }
  }

  void AtSurfaceCell(const SurfaceCell& cell, std::size_t view, Sight& sight) const {
    const CellPicture::Depths depths = pictures_[view].At(cell.centre);
    if (depths.point == 0) return;
    const Eigen::Vector3d towards = (views_[view].translation() - cell.centre).normalized();
    const double cosine = cell.normal.dot(towards);
    if (cosine < 0.05 || depths.point > depths.surface + kSeenWithin * grid_.cell_su()) return;
    sight.Add(towards, cosine);
  }

  const CellGrid& grid_;
  std::span<const Pose> views_;
  std::vector<CellPicture> pictures_;  // of each view
};

std::optional<ViewNeed> NeedOf(const SurfaceCell& cell, const Sight& sight) {
  if (cell.inferred > 0.5 || cell.confidence < kLowConfidence) return ViewNeed::kUncertain;
  if (cell.observations < 1.5) return ViewNeed::kThin;
  if (sight.num_views == 0) return std::nullopt;  // the grid is too coarse to tell
  if (sight.best_cosine < kFlatAngle) return ViewNeed::kGrazing;
  if (sight.from[0].dot(sight.from[1]) > kSameSide) return ViewNeed::kOneSided;
  return std::nullopt;
}

// Hidden cells beside those that were seen through.
class HiddenBorder {
 public:
  HiddenBorder(const CellGrid& grid, const Space& space) : grid_(grid), space_(space) {}

  void AddTo(std::vector<WantedPlace>& places) const {
    Eigen::Vector3i at;
    for (at.z() = 1; at.z() + 1 < grid_.size().z(); ++at.z()) {
      for (at.y() = 1; at.y() + 1 < grid_.size().y(); ++at.y()) {
        for (at.x() = 1; at.x() + 1 < grid_.size().x(); ++at.x()) {
          if (IsBorder(at)) Add(at, places);
        }
      }
    }
  }

 private:
  bool IsFree(const Eigen::Vector3i& at) const { return space_.IsFree(grid_.Index(at)); }
  bool IsHidden(const Eigen::Vector3i& at) const {
    const std::size_t index = grid_.Index(at);
    return !grid_.IsTouched(index) && !space_.IsFree(index) &&
           space_.num_hiding[index] >= kMinHidingViews;
  }
  bool IsBorder(const Eigen::Vector3i& at) const {
    if (!IsHidden(at)) return false;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i step = Eigen::Vector3i::Unit(axis);
      if (IsFree(at + step) || IsFree(at - step)) return true;
    }
    return false;
  }
  void Add(const Eigen::Vector3i& at, std::vector<WantedPlace>& places) const {
    Eigen::Vector3d towards_free = Eigen::Vector3d::Zero();
    int num_hidden = 0;
    Eigen::Vector3i step;
    for (step.z() = -1; step.z() <= 1; ++step.z()) {
      for (step.y() = -1; step.y() <= 1; ++step.y()) {
        for (step.x() = -1; step.x() <= 1; ++step.x()) {
          if (IsFree(at + step)) towards_free += step.cast<double>();
          if (IsHidden(at + step)) ++num_hidden;
        }
      }
    }
    if (num_hidden - 1 < kMinHiddenNeighbours || !(towards_free.norm() > 0)) return;
    places.push_back({.centre = grid_.Centre(at), .normal = towards_free.normalized()});
  }

  const CellGrid& grid_;
  const Space& space_;
};

}  // namespace

double WantedPlace::ShareShownFrom(const Eigen::Vector3d& towards_camera) const {
  const double cosine = normal.dot(towards_camera);
  switch (need) {
    case ViewNeed::kHidden:  // what of its face is seen, from either side
      return std::abs(cosine) > kGoodAngle ? std::abs(cosine) : 0;
    case ViewNeed::kUncertain:
    case ViewNeed::kThin:
      return cosine > kGoodAngle ? 1 : 0;
    case ViewNeed::kGrazing:
      return cosine > kMuchBetterAngle ? 1 : 0;
    case ViewNeed::kOneSided: {
      const bool is_other_side = seen_from[0].dot(towards_camera) < kOtherSide &&
                                 seen_from[1].dot(towards_camera) < kOtherSide;
      return cosine > kGoodAngle && is_other_side ? 1 : 0;
    }
  }
  return 0;
}

std::vector<WantedPlace> FindWantedPlaces(const CellGrid& grid, std::span<const Pose> views,
                                          const CameraModel& camera, double distance_su,
                                          const Eigen::Vector3d& up) {
  const Looks looks(grid, views, camera, up);
  const Space space = looks.AtSpace(kFar * distance_su);
  const std::vector<Sight> sights = looks.AtSurface();
  std::vector<WantedPlace> places;
  HiddenBorder(grid, space).AddTo(places);
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const SurfaceCell& cell = grid.surface()[i];
    if (const std::optional<ViewNeed> need = NeedOf(cell, sights[i])) {
      places.push_back({.centre = cell.centre,
                        .normal = cell.normal,
                        .need = *need,
                        .seen_from = sights[i].from});
    }
  }
  for (WantedPlace& place : places) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Pose& view : views) {
      nearest = std::min(nearest, (view.translation() - place.centre).norm());
    }
    const double share = (kFar - nearest / distance_su) / (kFar - kNear);
    place.area_su2 = std::clamp(share, 0.0, 1.0) * grid.cell_su() * grid.cell_su();
  }
  std::erase_if(places, [](const WantedPlace& place) { return place.area_su2 == 0; });
  return places;
}

}  // namespace mono3d
