// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_growth.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "mono3d/geometry/triangulation.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/start/model_comparison.h"
#include "tracking/start/two_view_start.h"

namespace mono3d::tracking {
namespace {

// Photos that are placed before the next adjustment: an equal share of those that were there, and
// of the candidates those that show nearly as much as the best.
constexpr double kMaxNewShare = 0.25;
constexpr double kMinOfBestShare = 0.7;
// Pairs that are looked at for a start, of those with a quarter as many matches as the best has.
constexpr std::size_t kMaxStartPairs = 200;
constexpr double kMinOfMostMatches = 0.25;
// Rounds of taking photos out and placing them again.
constexpr int kMaxRounds = 4;
// Rounds of taking motions from poses, and poses from what was moved: what is left falls with each
// by the share of the way between photos that the readout takes.
constexpr int kShutterRounds = 3;

struct PhotoStart {
  std::size_t a = 0;
  std::size_t b = 0;
  TwoViewStart motion;
  bool is_clear = true;  // the only motion that the two leave open
  double score = 0;
};

// Many points under large parallax; beyond fifteen degrees more of it does not help.
double ScoreOfPhotoStart(const TwoViewStart& motion) {
  constexpr double kEnough = 15 * std::numbers::pi / 180;
  const Eigen::Vector3d centre_b = motion.T_b_a.Inverse().translation();
  double score = 0;
  for (const Eigen::Vector3d& p_a : motion.p_a) {
    const double cosine = CosParallax(p_a, Eigen::Vector3d::Zero(), centre_b);
    score += std::min(std::acos(std::clamp(cosine, -1.0, 1.0)), kEnough);
  }
  return score;
}

// The matched features alone.
View ViewOfMatches(const PhotoFeatures& photo, const PhotoPair& pair, bool is_a) {
  View view;
  for (const FeatureMatch& match : pair.matches) {
    Feature feature;
    feature.pixel = photo.pixels[is_a ? match.feature_a : match.feature_b];
    view.features.push_back(feature);
  }
  return view;
}

StartAttempt TryPhotoPair(const PhotoScene& scene, const PhotoPair& pair,
                          const PhotoMapperOptions& options) {
  InitialisationOptions start;
  start.min_matches = options.min_matches;
  start.min_points = options.min_matches;
  start.min_parallax_deg = options.min_parallax_deg;
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < pair.matches.size(); ++i) matches.push_back({i, i});
  return StartFromTwoViews(ViewOfMatches(scene.features(pair.a), pair, true),
                           ViewOfMatches(scene.features(pair.b), pair, false), matches,
                           scene.camera(), start, options.seed);
}

// Evenly from those with most to those with fewest matches: where photos lie close, as the images
// of a video, those with most are all neighbours, hardly apart. `ranked`: most matches first.
std::vector<const PhotoPair*> PairsToTry(std::vector<const PhotoPair*> ranked) {
  if (ranked.size() <= kMaxStartPairs) return ranked;
  const double least = kMinOfMostMatches * static_cast<double>(ranked.front()->matches.size());
  const auto end = std::ranges::find_if(ranked, [&](const PhotoPair* pair) {
    return static_cast<double>(pair->matches.size()) < least;
  });
  const auto count = std::max(static_cast<std::size_t>(end - ranked.begin()), kMaxStartPairs);
  std::vector<const PhotoPair*> chosen;
  for (std::size_t i = 0; i < kMaxStartPairs; ++i) {
    chosen.push_back(ranked[i * count / kMaxStartPairs]);
  }
  return chosen;
}

// Clear ones first, the best in front.
std::vector<PhotoStart> FindPhotoStarts(const PhotoScene& scene, std::span<const PhotoPair> pairs,
                                        const std::vector<char>& is_free,
                                        const PhotoMapperOptions& options, std::string& reason) {
  std::vector<const PhotoPair*> ranked;
  for (const PhotoPair& pair : pairs) {
    if (is_free[pair.a] != 0 && is_free[pair.b] != 0) ranked.push_back(&pair);
  }
  if (ranked.empty()) reason = "no other photo shows the same";
  std::ranges::stable_sort(ranked, [](const PhotoPair* l, const PhotoPair* r) {
    return l->matches.size() > r->matches.size();
  });
  std::vector<PhotoStart> starts;
  for (const PhotoPair* pair : PairsToTry(ranked)) {
    StartAttempt attempt = TryPhotoPair(scene, *pair, options);
    if (attempt.candidates.empty()) reason = attempt.reason;
    const bool is_clear = attempt.candidates.size() == 1;
    for (TwoViewStart& motion : attempt.candidates) {
      const double score = ScoreOfPhotoStart(motion);
      starts.push_back({pair->a, pair->b, std::move(motion), is_clear, score});
    }
  }
  std::ranges::stable_sort(starts, [](const PhotoStart& l, const PhotoStart& r) {
    return l.is_clear != r.is_clear ? l.is_clear : l.score > r.score;
  });
  return starts;
}

int NumFittingInAll(const PhotoScene& scene) {
  int sum = 0;
  for (const std::size_t photo : scene.posed()) sum += scene.NumFitting(photo);
  return sum;
}

constexpr int kMinPhotos = 3;

struct GrownMap {
  PlacedScene placed;
  int num_fitting;
  std::vector<double> losses;  // as PhotoScene::Losses has them
};

// Whether the first of the maps that grew from the motions of two photos shows more than the others
// beyond chance.
bool IsClear(const std::vector<GrownMap>& motions) {
  return std::all_of(motions.begin() + 1, motions.end(), [&](const GrownMap& other) {
    return IsClearlyBetterOfInliers(motions.front().losses, other.losses, kChi2TwoDof);
  });
}

// One map of the free photos that grows.
class PhotoGrowth {
 public:
  PhotoGrowth(PhotoScene& scene, const std::vector<char>& is_free, std::span<const PhotoTime> times,
              const PhotoMapperOptions& options)
      : scene_(scene), is_free_(is_free), times_(times), options_(options) {
    has_shutter_ = std::ranges::any_of(
        times, [](const PhotoTime& time) { return !time.sensor.shutter.IsGlobal(); });
  }

  GrownMap Grow(const PhotoStart& start) {
    scene_.Clear();
    failed_at_.assign(scene_.num_photos(), 0);
    scene_.SetPose(start.a, Pose());
    scene_.SetPose(start.b, start.motion.T_b_a);
    // Depths of about 1 keep the numbers of the solvers in range.
    scene_.Triangulate();
    scene_.Normalise(start.a);
    Settle(kGrowingMinGain);
    while (PlaceNext()) Settle(kGrowingMinGain);
    Finish();
    return {scene_.Placed(), NumFittingInAll(scene_), scene_.Losses(is_free_)};
  }

  void Finish() {
    failed_at_.assign(scene_.num_photos(), 0);
    Complete();
    if (has_shutter_) {
      if (FollowShutters()) Complete();
    } else if (!times_.empty()) {
      scene_.FollowShutters(times_);  // moves nothing, but who calibrates asks how they moved
    }
  }

 private:
  // Photos out that do not fit, and in that do, until nothing changes.
  void Complete() {
    for (int round = 0; round < kMaxRounds; ++round) {
      Settle(kFinalMinGain);
      const bool has_removed = RemoveWeak();
      failed_at_.assign(scene_.num_photos(), 0);
      bool has_placed = false;
      while (PlaceNext()) {
        has_placed = true;
        Settle(kGrowingMinGain);
      }
      if ((!has_removed && !has_placed) || options_.IsStopped()) break;
    }
    RemoveWeak();
    Settle(kFinalMinGain);
  }

  // Poses tell how each photo moved while its lines were read, and that moves what they rest on.
  // False, and as it was before, where no more of the features fit then: photos may be too far
  // apart in time to tell of each other's motion.
  bool FollowShutters() {
    const std::vector<std::size_t> posed = scene_.posed();
    std::vector<Pose> before;
    for (const std::size_t photo : posed) before.push_back(*scene_.T_cam_world(photo));
    const int num_fitting = NumFittingInAll(scene_);
    for (int round = 0; round < kShutterRounds; ++round) {
      scene_.FollowShutters(times_);
      Settle(kFinalMinGain);
    }
    if (NumFittingInAll(scene_) > num_fitting) return true;
    scene_.ForgetShutters();
    for (std::size_t i = 0; i < posed.size(); ++i) scene_.SetPose(posed[i], before[i]);
    Settle(kFinalMinGain);
    return false;
  }

  // Points of all that is placed, then all adjusted; what fits only then makes more points.
  void Settle(double min_gain) {
    scene_.Triangulate();
    scene_.Adjust(min_gain);
    scene_.Triangulate();
  }

  // The next photos, those that show most points of the map. False where there are none.
  bool PlaceNext() {
    TellProgress();
    if (options_.IsStopped()) return false;
    std::vector<std::pair<int, std::size_t>> candidates;  // points, photo
    for (std::size_t photo = 0; photo < scene_.num_photos(); ++photo) {
      if (is_free_[photo] == 0 || scene_.T_cam_world(photo)) continue;
      const int num_points = scene_.NumPointsFor(photo);
      // One that could not be placed is tried again once it shows more.
      if (num_points < options_.min_inliers || num_points <= failed_at_[photo]) continue;
      candidates.emplace_back(num_points, photo);
    }
    std::ranges::stable_sort(candidates,
                             [](const auto& l, const auto& r) { return l.first > r.first; });
    const auto max_new = std::max<std::size_t>(
        1, static_cast<std::size_t>(kMaxNewShare * static_cast<double>(scene_.posed().size())));
    std::size_t num_new = 0;
    int most = 0;
    for (const auto& [num_points, photo] : candidates) {
      if (num_new == max_new || num_points < kMinOfBestShare * most) break;
      const std::optional<Pose> pose = scene_.FindPose(photo, options_.min_inliers, options_.seed);
      if (!pose) {
        failed_at_[photo] = num_points + num_points / 10;
        continue;
      }
      scene_.SetPose(photo, *pose);
      most = std::max(most, num_points);
      ++num_new;
    }
    return num_new > 0;
  }

  void TellProgress() const {
    if (!options_.on_progress) return;
    options_.on_progress({PhotoMapperProgress::Step::kPlacing,
                          static_cast<std::int64_t>(scene_.posed().size()),
                          std::ranges::count(is_free_, 1)});
  }

  // Photos that too few points agree with after the adjustment.
  bool RemoveWeak() {
    std::vector<std::size_t> weak;
    for (const std::size_t photo : scene_.posed()) {
      if (scene_.NumFitting(photo) < options_.min_inliers) weak.push_back(photo);
    }
    for (const std::size_t photo : weak) scene_.RemovePose(photo);
    if (!weak.empty()) scene_.Triangulate();
    return !weak.empty();
  }

  PhotoScene& scene_;
  const std::vector<char>& is_free_;
  std::span<const PhotoTime> times_;
  const PhotoMapperOptions& options_;
  bool has_shutter_ = false;
  std::vector<int> failed_at_;  // points that each photo had when it could not be placed
};

}  // namespace

int GrowPhotoMap(PhotoScene& scene, std::span<const PhotoPair> pairs,
                 const std::vector<char>& is_free, std::span<const PhotoTime> times,
                 const PhotoMapperOptions& options, std::string& reason) {
  const std::vector<PhotoStart> starts = FindPhotoStarts(scene, pairs, is_free, options, reason);
  const auto num_free = std::ranges::count(is_free, 1);
  PhotoGrowth growth(scene, is_free, times, options);
  std::vector<char> is_placed(scene.num_photos(), 0);  // from a start before
  std::set<std::pair<std::size_t, std::size_t>> is_tried;
  PlacedScene best;
  int most = 0;
  int num_tried = 0;
  for (std::size_t i = 0; i < starts.size() && num_tried < options.max_starts; ++i) {
    if (num_tried > 0 && options.IsStopped()) break;
    const PhotoStart& start = starts[i];
    if (is_placed[start.a] != 0 && is_placed[start.b] != 0) continue;
    if (!is_tried.emplace(start.a, start.b).second) continue;
    ++num_tried;
    std::vector<GrownMap> motions;  // that the two photos leave open
    for (const PhotoStart& motion : std::span(starts).subspan(i)) {
      if (motion.a == start.a && motion.b == start.b) motions.push_back(growth.Grow(motion));
    }
    std::ranges::stable_sort(motions, {}, [](const GrownMap& map) { return Sum(map.losses); });
    GrownMap& map = motions.front();
    const auto num_photos = static_cast<int>(map.placed.photos.size());
    if (num_photos < kMinPhotos || !IsClear(motions)) continue;
    if (start.is_clear && 2 * num_photos > num_free) return num_photos;
    for (const PlacedScene::Photo& photo : map.placed.photos) is_placed[photo.photo] = 1;
    if (map.num_fitting <= most) continue;
    most = map.num_fitting;
    best = std::move(map.placed);
  }
  if (!best.photos.empty()) {
    scene.Place(best);
    return static_cast<int>(best.photos.size());
  }
  scene.Clear();
  if (!starts.empty()) reason = "no third photo shows what two others show";
  return 0;
}

void CompletePhotoMap(PhotoScene& scene, const std::vector<char>& is_free,
                      std::span<const PhotoTime> times, const PhotoMapperOptions& options) {
  PhotoGrowth(scene, is_free, times, options).Finish();
}

}  // namespace mono3d::tracking
