// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/map_initialiser.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "image/state_archive.h"
#include "mono3d/geometry/two_view_ransac.h"
#include "tracking/features/image_shift.h"
#include "tracking/map/map_checks.h"
#include "tracking/map/map_state.h"

namespace mono3d::tracking {
namespace {

constexpr std::size_t kMaxViews = 16;   // kept: beyond, every second one goes
constexpr std::size_t kMaxBetween = 3;  // views that help to select a motion: each is matched
// Between the views of a start, in readout times of a rolling shutter, whose motions are not known
// yet: where the camera sways, these are taken for a turn of up to so large a part of its way.
constexpr double kMinReadouts = 20;

}  // namespace

std::optional<MapStart> MapInitialiser::Add(View view, std::string& reason) {
  const auto num_features = static_cast<int>(view.features.size());
  if (num_features < options_.min_matches) {
    views_.clear();
    is_first_lost_ = false;
    reason = std::to_string(num_features) + " features, " + std::to_string(options_.min_matches) +
             " needed";
    return std::nullopt;
  }
  const auto is_too_old = [&](const View& old) {
    return view.frame.timestamp_s - old.frame.timestamp_s > options_.max_wait_s;
  };
  if (std::erase_if(views_, is_too_old) > 0) is_first_lost_ = false;
  NoteImageMotion(view);
  reason = "first view taken, waiting for parallax";
  std::size_t oldest = FirstThatShares(view, reason);
  // While no view is lost from sight, waiting costs nothing.
  const bool can_wait = oldest == 0 || (oldest == 1 && is_first_lost_);
  // Views that share too little with the newest one will share less with the next; one of them may
  // still tell two motions apart.
  if (oldest > 1) {
    views_.erase(views_.begin(), views_.begin() + static_cast<std::ptrdiff_t>(oldest - 1));
    oldest = 1;
  }
  is_first_lost_ = oldest > 0;
  const double readout_s = std::abs(view.frame.sensor.shutter.readout_s);
  const double min_wait_s = std::min(kMinReadouts * readout_s, 0.5 * options_.max_wait_s);
  if (can_wait && oldest < views_.size() &&
      view.frame.timestamp_s - views_[oldest].frame.timestamp_s < min_wait_s) {
    reason = "waiting for a path longer than the motion during the readout";
    Keep(std::move(view));
    return std::nullopt;
  }
  // The second try: half as old, so better matched, where the first has parallax but no clear
  // motion.
  std::vector<std::size_t> tries;
  const std::size_t num_sharing = views_.size() - oldest;
  if (num_sharing > 0) tries.push_back(oldest);
  if (num_sharing > 3) tries.push_back(oldest + num_sharing / 2);
  for (const std::size_t first : tries) {
    std::string this_reason;
    std::optional<TwoViewStart> motion = Try(first, view, can_wait, this_reason);
    if (first == oldest) reason = this_reason;
    if (!motion) continue;
    MapStart start;
    start.first = std::move(views_[first]);
    start.second = std::move(view);
    start.motion = *std::move(motion);
    views_.clear();
    is_first_lost_ = false;
    return start;
  }
  Keep(std::move(view));
  return std::nullopt;
}

// Of the view, and of the last one, which has one behind it now. A global shutter needs none.
void MapInitialiser::NoteImageMotion(View& view) {
  if (view.frame.sensor.shutter.IsGlobal() || views_.empty()) return;
  View& last = views_.back();
  std::vector<PointPair> pairs;
  for (const FeatureMatch& match : Match(last, view)) {
    pairs.push_back({last.features[match.feature_a].pixel, view.features[match.feature_b].pixel});
  }
  TwoViewRansacOptions ransac;
  ransac.seed = seed_;
  const std::optional<TwoViewModel> moved = EstimateHomography(pairs, ransac);
  if (!moved || moved->num_inliers < options_.min_matches / 2) return;
  const double later_s = view.frame.timestamp_s - last.frame.timestamp_s;
  if (!(later_s > 0)) return;
  const Eigen::Matrix3d H_view_last = moved->matrix.normalized();
  const Eigen::Matrix3d H_last_view = H_view_last.inverse().normalized();
  std::vector<ImageMotion::Neighbour> of_view{{H_last_view, -later_s}};
  std::vector<ImageMotion::Neighbour> of_last{{H_view_last, later_s}};
  const std::vector<ImageMotion::Neighbour>& before_last = last.image_motion.neighbours();
  if (!before_last.empty()) {
    const ImageMotion::Neighbour& before = before_last.front();
    of_view.push_back({(before.H_other_here * H_last_view).normalized(), before.later_s - later_s});
    of_last.insert(of_last.begin(), before);
  }
  const auto of = [](const View& at, std::vector<ImageMotion::Neighbour> neighbours) {
    return ImageMotion(at.frame.camera, at.frame.sensor, std::move(neighbours));
  };
  view.image_motion = of(view, std::move(of_view));
  last.image_motion = of(last, std::move(of_last));
}

// The number of the oldest view that shares enough with the newest one, as many as there are where
// none does.
std::size_t MapInitialiser::FirstThatShares(const View& view, std::string& reason) const {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const bool is_last = i + 1 == views_.size();
    const auto num_matches =
        static_cast<int>((is_last ? Match(views_[i], view) : MatchNear(views_[i], view)).size());
    if (num_matches >= options_.min_matches) return i;
    reason = std::to_string(num_matches) + " matches, " + std::to_string(options_.min_matches) +
             " needed";
  }
  return views_.size();
}

// `can_wait`: no view is given up meanwhile.
std::optional<TwoViewStart> MapInitialiser::Try(std::size_t first, const View& view, bool can_wait,
                                                std::string& reason) const {
  const View& a = views_[first];
  const CameraModel& camera = view.frame.camera;
  StartAttempt attempt = StartFromTwoViews(a, view, Match(a, view), camera, options_, seed_);
  reason = attempt.reason;
  if (attempt.is_near_turn && can_wait) {
    reason = "too little parallax: a turn on the spot explains the views nearly as well";
    return std::nullopt;
  }
  if (attempt.candidates.empty()) return std::nullopt;
  TwoViewStart& only = attempt.candidates.front();
  if (attempt.candidates.size() == 1 && attempt.unlikely.empty() && !only.is_planar) {
    return std::move(only);  // nothing to compare it with: no other view is matched
  }
  const std::vector<BetweenView> others = SupportViews(first, view);
  std::optional<TwoViewStart> motion =
      SelectMotion(attempt.candidates, attempt.unlikely, a, view, others, camera);
  if (!motion) {
    reason = "two motions explain the views equally well";
  } else if (!motion->is_adjusted && motion->is_planar && can_wait &&
             IsRefuted(*motion, a, view, others, camera)) {
    reason = "the motion over a plane that two views leave open does not hold for others";
    return std::nullopt;
  }
  return motion;
}

// Views between the two of a start, or the one before them where there is none between.
std::vector<BetweenView> MapInitialiser::SupportViews(std::size_t first, const View& view) const {
  const View& a = views_[first];
  const double duration_s = view.frame.timestamp_s - a.frame.timestamp_s;
  std::vector<BetweenView> supports;
  const auto add = [&](const View& support) {
    const double progress =
        duration_s > 0 ? (support.frame.timestamp_s - a.frame.timestamp_s) / duration_s : 0.5;
    supports.push_back({&support, progress, Match(a, support)});
  };
  const std::size_t num_between = views_.size() - first - 1;
  const std::size_t num_used = std::min(num_between, kMaxBetween);
  for (std::size_t i = 0; i < num_used; ++i) {
    add(views_[first + (i + 1) * (num_between + 1) / (num_used + 1)]);
  }
  if (num_used == 0 && first > 0) add(views_[first - 1]);
  return supports;
}

std::vector<FeatureMatch> MapInitialiser::MatchNear(const View& a, const View& b) const {
  return MatchNearby(a, b, {options_.search_radius_share * b.frame.camera.width, kMaxStartLevel});
}

// Near where they were, or else where most of the image has gone.
std::vector<FeatureMatch> MapInitialiser::Match(const View& a, const View& b) const {
  std::vector<FeatureMatch> matches = MatchNear(a, b);
  if (static_cast<int>(matches.size()) >= options_.min_matches) return matches;
  const auto shift_px = CommonShift(a, std::vector<char>(a.features.size(), 1), b, kMaxStartLevel);
  if (!shift_px) return matches;
  return MatchNearby(
      a, b, {options_.search_radius_share * b.frame.camera.width, kMaxStartLevel, *shift_px});
}

void MapInitialiser::Keep(View view) {
  views_.push_back(std::move(view));
  if (views_.size() <= kMaxViews) return;
  // Every second one goes, but the oldest and the newest stay.
  std::vector<View> kept;
  for (std::size_t i = 0; i < views_.size(); i += 2) kept.push_back(std::move(views_[i]));
  views_ = std::move(kept);
}

template <typename Archive>
void MapInitialiser::ExchangeState(Archive& archive, const CameraModel& camera, int num_levels) {
  archive.Sections(views_, 1, [&](View& view) {
    tracking::ExchangeState(archive, view);
    std::vector<ImageMotion::Neighbour> neighbours = view.image_motion.neighbours();
    archive.List(neighbours, [&](ImageMotion::Neighbour& neighbour) {
      ExchangeElements(archive, neighbour.H_other_here);
      ExchangeBounded(archive, neighbour.later_s);
    });
    if constexpr (Archive::kReads) {
      view.image_motion = ImageMotion(view.frame.camera, view.frame.sensor, std::move(neighbours));
    }
  });
  archive.Number(is_first_lost_);
  if constexpr (Archive::kReads) {
    const auto is_view = [&](const View& view) {
      const auto is_feature = [&](const Feature& feature) {
        return IsFeatureOf(camera, num_levels, feature);
      };
      return view.points.size() == view.features.size() && !view.grid.IsEmpty() &&
             view.frame.camera == camera && std::ranges::all_of(view.features, is_feature) &&
             std::ranges::none_of(view.points, [](const auto& point) { return point.has_value(); });
    };
    if (views_.size() > kMaxViews || !std::ranges::all_of(views_, is_view)) {
      archive.Refuse("contradicts itself");
    }
  }
}

template void MapInitialiser::ExchangeState(StateWriter&, const CameraModel&, int);
template void MapInitialiser::ExchangeState(StateReader&, const CameraModel&, int);

}  // namespace mono3d::tracking
