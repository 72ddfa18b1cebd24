// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/next_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <utility>

#include "mono3d/core/statistics.h"
#include "mono3d/pipeline/world_axes.h"
#include "pipeline/surface_cells.h"
#include "pipeline/wanted_places.h"

namespace mono3d {
namespace {

constexpr double kDegrees = std::numbers::pi / 180;
constexpr int kCellsInRow = 64;  // of an image, at the distance of the flight
constexpr int kPictureWidth = 96;
constexpr std::size_t kMaxViews = 120;  // of the flight, that are looked at
constexpr int kTargetSpacing = 8;       // cells
constexpr std::size_t kMaxTargets = 60;
constexpr int kNumAzimuths = 12;
constexpr std::array<double, 4> kElevations = {5 * kDegrees, 25 * kDegrees, 45 * kDegrees,
                                               70 * kDegrees};
// Distances of the flight: heights below the lowest and above the highest camera; from obstacles.
constexpr double kRoomBelow = 0.1, kRoomAbove = 0.25, kClearance = 0.15;
constexpr double kNearest = 0.3, kFarthest = 1.6;
constexpr double kMinKnownShare = 0.25;  // of an image, so that the camera is tracked

// What is hidden is new, the rest gets better.
double WorthOf(ViewNeed need) {
  switch (need) {
    case ViewNeed::kHidden:
      return 1;
    case ViewNeed::kUncertain:
    case ViewNeed::kThin:
    case ViewNeed::kGrazing:
      return 0.5;
    case ViewNeed::kOneSided:
      return 0.3;
  }
  return 0;
}

std::vector<Pose> SomeViews(const std::vector<TrajectoryEntry>& entries) {
  std::vector<Pose> views;
  const std::size_t step = (entries.size() + kMaxViews - 1) / kMaxViews;
  for (std::size_t i = 0; i < entries.size(); i += step) views.push_back(entries[i].T_world_cam);
  return views;
}

// Of what is in the middle of the images; 0 where they show nothing of the model.
double DistanceOfFlight(const PointCloud& model, const std::vector<Pose>& views,
                        const CameraModel& camera) {
  const std::size_t step = model.size() / 2000 + 1;
  std::vector<double> medians;
  for (const Pose& view : views) {
    const Pose T_cam_world = view.Inverse();
    std::vector<double> depths;
    for (std::size_t i = 0; i < model.size(); i += step) {
      const Eigen::Vector3d p_cam = T_cam_world * model.points[i].cast<double>();
      if (p_cam.z() > 0 && camera.Contains(camera.Project(p_cam))) depths.push_back(p_cam.z());
    }
    if (!depths.empty()) medians.push_back(Median(std::move(depths)));
  }
  return medians.empty() ? 0 : Median(std::move(medians));
}

Eigen::Vector3d UpOf(const MapReconstruction& map) {
  if (IsLevel(map.axes)) return Eigen::Vector3d::UnitZ();
  const WorldAxes axes = ChooseWorldAxes(map);
  if (axes.source != AxesSource::kLevel) return -Eigen::Vector3d::UnitY();
  return axes.S_axes_world.pose().rotation().inverse() * Eigen::Vector3d::UnitZ();
}

Pose LookingAt(const Eigen::Vector3d& from, const Eigen::Vector3d& target,
               const Eigen::Vector3d& up) {
  const Eigen::Vector3d ahead = (target - from).normalized();
  const Eigen::Vector3d right = ahead.cross(up).normalized();
  Eigen::Matrix3d R;
  R << right, ahead.cross(right), ahead;
  return {R, from};
}

// The middles of where most is wanted.
std::vector<Eigen::Vector3d> TargetsAmong(const std::vector<WantedPlace>& places, double cell_su) {
  struct Sum {
    double area_su2 = 0;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  };
  std::map<std::array<std::int64_t, 3>, Sum> sums;
  for (const WantedPlace& place : places) {
    const Eigen::Array3d at = (place.centre / (kTargetSpacing * cell_su)).array().floor();
    Sum& sum = sums[{std::llround(at.x()), std::llround(at.y()), std::llround(at.z())}];
    sum.area_su2 += place.area_su2;
    sum.centre += place.area_su2 * place.centre;
  }
  std::vector<Sum> ordered;
  for (const auto& [at, sum] : sums) ordered.push_back(sum);
  std::ranges::stable_sort(ordered, std::ranges::greater(), &Sum::area_su2);
  ordered.resize(std::min(ordered.size(), kMaxTargets));
  std::vector<Eigen::Vector3d> targets;
  for (const Sum& sum : ordered) targets.emplace_back(sum.centre / sum.area_su2);
  return targets;
}

// Where a camera may be: at heights of the flight and away from what is known.
class FlyingSpace {
 public:
  FlyingSpace(const CellGrid& grid, const std::vector<Pose>& views, const Eigen::Vector3d& up,
              double distance_su)
      : grid_(grid), up_(up), clearance_su_(kClearance * distance_su) {
    std::vector<double> heights;
    for (const Pose& view : views) heights.push_back(up.dot(view.translation()));
    const auto [lowest, highest] = std::ranges::minmax(heights);
    low_ = lowest - kRoomBelow * distance_su;
    high_ = highest + kRoomAbove * distance_su;
  }

  bool Allows(const Eigen::Vector3d& position) const {
    const double height = up_.dot(position);
    if (height < low_ || height > high_) return false;
    return std::ranges::none_of(grid_.surface(), [&](const SurfaceCell& cell) {
      return (cell.centre - position).squaredNorm() < clearance_su_ * clearance_su_;
    });
  }

 private:
  const CellGrid& grid_;
  Eigen::Vector3d up_;
  double clearance_su_;
  double low_ = 0, high_ = 0;
};

struct CandidateView {
  Pose T_world_cam;
  Eigen::Vector3d target_world;
  // Of what it gains beside the views that were taken: what that is, or would be with nothing
  // before it.
  double most_su2 = 0;
  bool is_drawn = false;
  std::vector<std::pair<std::uint32_t, double>> shown = {};  // places, and how much of their area
};

// What is wanted, as each of the views that are possible shows it. What stands before what takes a
// picture to find out; pictures are drawn of those views alone that could be the best.
class ViewPlanner {
 public:
  ViewPlanner(const CellGrid& grid, std::vector<WantedPlace> places, const CameraModel& camera,
              double distance_su)
      : grid_(grid), places_(std::move(places)), camera_(camera), distance_su_(distance_su) {}

  void AddCandidates(const FlyingSpace& space, const Eigen::Vector3d& up) {
    const Eigen::Vector3d east = up.unitOrthogonal();
    const Eigen::Vector3d north = up.cross(east);
    for (const Eigen::Vector3d& target : TargetsAmong(places_, grid_.cell_su())) {
      for (int i = 0; i < kNumAzimuths; ++i) {
        const double azimuth = 2 * std::numbers::pi * i / kNumAzimuths;
        const Eigen::Vector3d level = std::cos(azimuth) * east + std::sin(azimuth) * north;
        for (const double elevation : kElevations) {
          const Eigen::Vector3d towards = std::cos(elevation) * level + std::sin(elevation) * up;
          const Eigen::Vector3d position = target + distance_su_ * towards;
          candidates_.push_back({LookingAt(position, target, up), target});
        }
      }
    }
    ForEach(candidates_.size(), [&](std::size_t i) {
      CandidateView& candidate = candidates_[i];
      if (!space.Allows(candidate.T_world_cam.translation())) return;
      candidate.most_su2 = kRounding * GainOf(FindShown(candidate, nullptr));
    });
  }

  // The best of all, beside those that were taken before, the first of equals; nothing below
  // `min_worth_su2`.
  std::optional<NextView> TakeBest(double min_worth_su2) {
    for (;;) {
      std::vector<CandidateView*> first = Promising();
      CandidateView& best = *first.front();
      if (best.most_su2 <= min_worth_su2) return std::nullopt;
      if (best.is_drawn) {
        const double gain_su2 = GainOf(best.shown);
        if (gain_su2 == best.most_su2) return Taken(best);
        best.most_su2 = gain_su2;
        continue;
      }
      std::erase_if(first, [](const CandidateView* candidate) { return candidate->is_drawn; });
      ForEach(first.size(), [&](std::size_t i) { Draw(*first[i]); });
    }
  }

  bool IsEmpty() const { return candidates_.empty(); }

 private:
  // Pictures that are drawn together, on all processors.
  static constexpr std::ptrdiff_t kBatch = 16;
  // Above what a sum of the same numbers in another order can be.
  static constexpr double kRounding = 1 + 1e-9;

  template <typename Work>
  static void ForEach(std::size_t num, const Work& work) {
    cv::parallel_for_({0, static_cast<int>(num)}, [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) work(static_cast<std::size_t>(i));
    });
  }

  double GainOf(const std::vector<std::pair<std::uint32_t, double>>& shown) const {
    double gain_su2 = 0;
    for (const auto& [place, share] : shown) {
      gain_su2 += WorthOf(places_[place].need) * share * places_[place].area_su2;
    }
    return gain_su2;
  }

  // Those that may gain most, the best first.
  std::vector<CandidateView*> Promising() {
    std::vector<CandidateView*> all;
    for (CandidateView& candidate : candidates_) all.push_back(&candidate);
    const auto end = all.begin() + std::min(kBatch, std::ssize(all));
    std::ranges::partial_sort(all, end, [](const CandidateView* a, const CandidateView* b) {
      return a->most_su2 != b->most_su2 ? a->most_su2 > b->most_su2 : a < b;
    });
    all.erase(end, all.end());
    return all;
  }

  void Draw(CandidateView& candidate) const {
    candidate.is_drawn = true;
    CellPicture picture(camera_, candidate.T_world_cam);
    // What is farther than all places hides none of them: it is drawn where it matters for how much
    // is known.
    const double farthest_su = kFarthest * distance_su_ + grid_.cell_su();
    picture.Draw(grid_.surface(), grid_.cell_su(), 0, farthest_su);
    if (picture.ShareCovered() < kMinKnownShare) {
      picture.Draw(grid_.surface(), grid_.cell_su(), farthest_su);
    }
    // Where a picture shows too little that is known, the camera would be lost.
    if (picture.ShareCovered() >= kMinKnownShare) {
      candidate.shown = FindShown(candidate, &picture);
    }
    candidate.most_su2 = GainOf(candidate.shown);
  }

  NextView Taken(const CandidateView& best) {
    NextView view{best.T_world_cam, best.target_world, {}};
    for (const auto& [place, share] : best.shown) {
      double& area_su2 = places_[place].area_su2;
      if (area_su2 > 0) view.gain_su2[places_[place].need] += share * area_su2;
      area_su2 = 0;
    }
    return view;
  }

  // Without a picture as if nothing stood before anything.
  std::vector<std::pair<std::uint32_t, double>> FindShown(const CandidateView& candidate,
                                                          const CellPicture* picture) const {
    std::vector<std::pair<std::uint32_t, double>> shown;
    const Eigen::Vector3d& centre = candidate.T_world_cam.translation();
    const PinholeView view(camera_, candidate.T_world_cam);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Eigen::Vector3d p_cam = view.InCamera(places_[i].centre);
      if (!(p_cam.z() >= kNearest * distance_su_ && p_cam.z() <= kFarthest * distance_su_) ||
          !view.Sees(p_cam)) {
        continue;
      }
      if (picture != nullptr &&
          p_cam.z() > picture->At(places_[i].centre).surface + 0.5 * grid_.cell_su()) {
        continue;
      }
      const double share = places_[i].ShareShownFrom((centre - places_[i].centre).normalized());
      if (share > 0) shown.emplace_back(static_cast<std::uint32_t>(i), share);
    }
    return shown;
  }

  const CellGrid& grid_;
  std::vector<WantedPlace> places_;
  CameraModel camera_;
  double distance_su_;
  std::vector<CandidateView> candidates_;
};

}  // namespace

const char* ToString(ViewNeed need) {
  switch (need) {
    case ViewNeed::kHidden:
      return "hidden";
    case ViewNeed::kUncertain:
      return "uncertain";
    case ViewNeed::kThin:
      return "thin";
    case ViewNeed::kGrazing:
      return "grazing";
    case ViewNeed::kOneSided:
      return "one_sided";
  }
  return "unknown";
}

const char* Explanation(ViewNeed need) {
  switch (need) {
    case ViewNeed::kHidden:
      return "hidden behind what was seen";
    case ViewNeed::kUncertain:
      return "uncertain: the images hardly match there";
    case ViewNeed::kThin:
      return "thin: in one depth map alone";
    case ViewNeed::kGrazing:
      return "seen at a flat angle alone";
    case ViewNeed::kOneSided:
      return "seen from one side alone";
  }
  return "unknown";
}

double NextView::Gain() const {
  double sum = 0;
  for (const auto& [need, area_su2] : gain_su2) sum += area_su2;
  return sum;
}

ViewNeed NextView::MainNeed() const {
  const auto most = std::ranges::max_element(
      gain_su2, {}, [](const auto& of_need) { return WorthOf(of_need.first) * of_need.second; });
  return most == gain_su2.end() ? ViewNeed::kHidden : most->first;
}

NextViews ProposeNextViews(const MapReconstruction& map, const NextViewsOptions& options) {
  NextViews next;
  const std::vector<Pose> views = SomeViews(map.model_trajectory);
  const CameraModel camera = map.sparse.camera.WithoutDistortion();
  if (map.model.empty() || views.empty() || camera.width <= 0) return next;
  next.distance_su = DistanceOfFlight(map.model, views, camera);
  if (!(next.distance_su > 0)) return next;
  const CellGrid grid(map.model, next.distance_su * camera.width / camera.fx / kCellsInRow);
  next.cell_su = grid.cell_su();
  const double cell_su2 = grid.cell_su() * grid.cell_su();
  next.surface_su2 = cell_su2 * static_cast<double>(grid.surface().size());
  const CameraModel small =
      camera.Resized(kPictureWidth, std::max(1, kPictureWidth * camera.height / camera.width));
  const Eigen::Vector3d up = UpOf(map);
  std::vector<WantedPlace> places = FindWantedPlaces(grid, views, small, next.distance_su, up);
  for (const WantedPlace& place : places) next.area_su2[place.need] += place.area_su2;
  ViewPlanner planner(grid, std::move(places), small, next.distance_su);
  planner.AddCandidates(FlyingSpace(grid, views, up, next.distance_su), up);
  const double image_su2 =
      next.distance_su * next.distance_su * camera.width / camera.fx * camera.height / camera.fy;
  while (!planner.IsEmpty() && static_cast<int>(next.views.size()) < options.max_views) {
    std::optional<NextView> view = planner.TakeBest(options.min_gain * image_su2);
    if (!view) break;
    next.views.push_back(*std::move(view));
  }
  return next;
}

}  // namespace mono3d
