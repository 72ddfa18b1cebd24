// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/initialiser.h"

#include <algorithm>
#include <utility>

#include "tracking/motion_choice.h"

namespace mono3d::tracking {
namespace {

constexpr std::size_t kMaxViews = 16;
constexpr std::size_t kMaxBetween = 3;  // views that help to choose a motion

}  // namespace

std::optional<MapStart> Initialiser::Add(View view, std::string& reason) {
  const auto num_features = static_cast<int>(view.features.size());
  if (num_features < options_.min_matches) {
    views_.clear();
    reason = std::to_string(num_features) + " features, " + std::to_string(options_.min_matches) +
             " needed";
    return std::nullopt;
  }
  std::erase_if(views_, [&](const View& old) {
    return view.frame.timestamp_s - old.frame.timestamp_s > options_.max_wait_s;
  });
  reason = "first view taken, waiting for parallax";
  // Views that share too little with the newest one will share less with the next.
  while (!views_.empty()) {
    const auto num_matches = static_cast<int>(Match(views_.front(), view).size());
    if (num_matches >= options_.min_matches) break;
    reason = std::to_string(num_matches) + " matches, " + std::to_string(options_.min_matches) +
             " needed";
    views_.erase(views_.begin());
  }
  // The second try: half as old, so better matched, where the first has parallax but no clear
  // motion.
  std::vector<std::size_t> tries;
  if (!views_.empty()) tries.push_back(0);
  if (views_.size() > 3) tries.push_back(views_.size() / 2);
  for (const std::size_t first : tries) {
    std::string this_reason;
    std::optional<TwoViewStart> motion = Try(first, view, this_reason);
    if (first == 0) reason = this_reason;
    if (!motion) continue;
    MapStart start;
    start.first = std::move(views_[first]);
    start.second = std::move(view);
    start.motion = *std::move(motion);
    views_.clear();
    return start;
  }
  Keep(std::move(view));
  return std::nullopt;
}

std::optional<TwoViewStart> Initialiser::Try(std::size_t first, const View& view,
                                             std::string& reason) const {
  const View& a = views_[first];
  const CameraModel& camera = view.frame.camera;
  StartAttempt attempt = StartFromTwoViews(a, view, Match(a, view), camera, options_, seed_);
  reason = attempt.reason;
  if (attempt.candidates.size() < 2) {
    if (attempt.candidates.empty()) return std::nullopt;
    return std::move(attempt.candidates.front());
  }
  std::vector<BetweenView> between;
  const std::size_t num_between = views_.size() - first - 1;
  const std::size_t num_used = std::min(num_between, kMaxBetween);
  for (std::size_t i = 0; i < num_used; ++i) {
    const View& middle = views_[first + (i + 1) * (num_between + 1) / (num_used + 1)];
    const double duration_s = view.frame.timestamp_s - a.frame.timestamp_s;
    const double progress =
        duration_s > 0 ? (middle.frame.timestamp_s - a.frame.timestamp_s) / duration_s : 0.5;
    between.push_back({&middle, progress, Match(a, middle)});
  }
  std::optional<TwoViewStart> motion = ChooseMotion(attempt.candidates, a, view, between, camera);
  if (!motion) reason = "two motions explain the views equally well";
  return motion;
}

std::vector<FeatureMatch> Initialiser::Match(const View& a, const View& b) const {
  constexpr int kMaxLevel = 3;  // coarser ones are too vague for a start
  return MatchNearby(a, b, options_.search_radius_share * b.frame.camera.width, kMaxLevel);
}

void Initialiser::Keep(View view) {
  views_.push_back(std::move(view));
  if (views_.size() <= kMaxViews) return;
  // Every second one goes, but the oldest and the newest stay.
  std::vector<View> kept;
  for (std::size_t i = 0; i < views_.size(); i += 2) kept.push_back(std::move(views_[i]));
  views_ = std::move(kept);
}

}  // namespace mono3d::tracking
