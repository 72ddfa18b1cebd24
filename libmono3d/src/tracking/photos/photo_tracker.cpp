// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_tracker.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "tracking/photos/photo_adjustment.h"

namespace mono3d::tracking {
namespace {

// What the photo shows of the map. Its own unit is the world's.
Keyframe KeyframeOfPhoto(const Frame& frame, std::int64_t id, const SparseImage& image,
                         const SparseModel& sparse) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.frame = frame;
  keyframe.velocity = image.velocity.value_or(CameraVelocity());
  const ShutterMotion shutter(frame.sensor, keyframe.velocity);
  const Pose T_cam_world = image.T_world_cam.Inverse();
  for (const SparseObservation& seen : image.observations) {
    const Eigen::Vector3d p_cam = T_cam_world * sparse.points[*seen.point].p_world;
    // From the middle line back to its own.
    const Eigen::Vector2d way = shutter.Project(frame.camera, p_cam) - frame.camera.Project(p_cam);
    keyframe.sparse_depths_su.push_back(static_cast<float>(p_cam.z()));
    keyframe.sparse_pixels.emplace_back((seen.pixel + way).cast<float>());
  }
  return keyframe;
}

std::size_t NumInLargest(const PhotoMaps& placed) {
  return placed.maps.empty() ? 0 : placed.maps.front().photos.size();
}

// Which photos may make a larger map: those that a chain of pairs links to the largest map there
// is, and those of a chain that is longer than it.
std::vector<bool> MayMakeLarger(const PhotoMaps& placed, const std::vector<PhotoPair>& pairs,
                                std::size_t num_photos) {
  std::vector<std::size_t> chain_of(num_photos);  // the first photo of the chain that each is in
  std::iota(chain_of.begin(), chain_of.end(), std::size_t{0});
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (const PhotoPair& pair : pairs) {
      const std::size_t first = std::min(chain_of[pair.a], chain_of[pair.b]);
      has_changed = has_changed || chain_of[pair.a] != chain_of[pair.b];
      chain_of[pair.a] = chain_of[pair.b] = first;
    }
  }
  std::vector<std::size_t> length(num_photos);
  for (const std::size_t chain : chain_of) ++length[chain];
  std::vector<bool> may_come;
  for (const std::size_t chain : chain_of) may_come.push_back(length[chain] > NumInLargest(placed));
  if (placed.maps.empty()) return may_come;
  const std::size_t of_largest = chain_of[placed.maps.front().photos.front().photo];
  for (std::size_t i = 0; i < num_photos; ++i) {
    if (chain_of[i] == of_largest) may_come[i] = true;
  }
  return may_come;
}

}  // namespace

PhotoTracker::PhotoTracker(const PhotoMapperOptions& options, StageTimes* times)
    : options_(options), times_(times) {
  options_.Validate();
}

TrackingResult PhotoTracker::Track(const Frame& frame) {
  Validate(frame);
  if (!frames_.empty() && !(frames_.front().camera == frame.camera)) {
    throw Error(ErrorParts{.what = "camera differs from the first photo's",
                           .where = frame.name,
                           .expected = "one camera for all photos",
                           .found = {}});
  }
  const ScopedStageTimer timer(times_, "tracking/photo_features");
  features_.push_back(ExtractPhotoFeatures(frame, options_.num_features, options_.max_side_px));
  frames_.push_back(frame);
  TrackingResult result;
  result.is_pending = true;
  result.reason = "photos are placed together, at the end";
  return result;
}

KeyframePosesPtr PhotoTracker::Poses() const {
  const std::lock_guard lock(mutex_);
  return poses_;
}

PhotoMaps PhotoTracker::PlaceBy(const std::vector<PhotoFeatures>& features,
                                const std::vector<PhotoPair>& pairs) const {
  const ScopedStageTimer timer(times_, "tracking/photo_mapping");
  std::vector<PhotoTime> times;
  if (options_.are_frames) {
    for (const Frame& frame : frames_) times.push_back({frame.timestamp_s, frame.sensor});
  }
  return MapPhotos(features, pairs, frames_.front().camera, options_, /*tolerance=*/1, times);
}

std::vector<PhotoPair> PhotoTracker::Match(const std::vector<PhotoFeatures>& features) const {
  const ScopedStageTimer timer(times_, "tracking/photo_matching");
  return MatchPhotos(features, options_);
}

// Whether, of those that may come by it, more than one image of a video is in no map or in another
// one than most are: to place all again takes as long as it did, or four times.
bool PhotoTracker::AreSomeLeft(const std::vector<bool>& may_come) const {
  constexpr double kMinShareLeft = 0.02;
  if (options_.IsStopped()) return false;
  std::vector<bool> is_left = may_come;
  if (!placed_->maps.empty()) {
    for (const PlacedPhoto& placed : placed_->maps.front().photos) is_left[placed.photo] = false;
  }
  const auto num_left = std::ranges::count(is_left, true);
  return static_cast<double>(num_left) > kMinShareLeft * static_cast<double>(frames_.size());
}

void PhotoTracker::TakeLarger(PhotoMaps maps, std::string_view by) {
  const std::size_t num_before = NumInLargest(*placed_);
  const std::size_t num = NumInLargest(maps);
  Log(LogLevel::kInfo, std::to_string(num) + " of " + std::to_string(frames_.size()) +
                           " photographs hang together by " + std::string(by) + ", " +
                           std::to_string(num_before) + " before");
  if (num > num_before) placed_ = std::move(maps);
}

// Once more with all matches that the epipolar geometry of two photos makes clear. In rooms and
// streets much looks alike, and is matched by its looks alone only where photos are close.
void PhotoTracker::PlaceByMoreMatches(std::vector<PhotoPair> pairs) {
  {
    const ScopedStageTimer timer(times_, "tracking/photo_matching");
    pairs = MatchAlongEpipolarLines(features_, std::move(pairs), options_);
  }
  TakeLarger(PlaceBy(features_, pairs), "matches along epipolar lines");
}

// Once more with twice as many features. Foliage in the wind, grass and gravel look alike
// everywhere: of so many features few find their like, too few for a pose.
void PhotoTracker::PlaceByMoreFeatures() {
  const int num_features = 2 * options_.num_features;
  std::vector<PhotoFeatures> features;
  {
    const ScopedStageTimer timer(times_, "tracking/photo_features");
    for (const Frame& frame : frames_) {
      if (options_.IsStopped()) return;
      features.push_back(ExtractPhotoFeatures(frame, num_features, options_.max_side_px));
      if (!options_.on_progress) continue;
      options_.on_progress({PhotoMapperProgress::Step::kFeatures,
                            static_cast<std::int64_t>(features.size()),
                            static_cast<std::int64_t>(frames_.size())});
    }
  }
  std::vector<PhotoPair> pairs = Match(features);
  // Parts that show nothing in common are none the larger for it.
  if (!AreSomeLeft(MayMakeLarger(*placed_, pairs, frames_.size()))) return;
  {
    const ScopedStageTimer timer(times_, "tracking/photo_matching");
    pairs = MatchAlongEpipolarLines(features, std::move(pairs), options_);
  }
  TakeLarger(PlaceBy(features, pairs), std::to_string(num_features) + " features each");
}

void PhotoTracker::Place() {
  if (placed_) return;
  BringInOrder();
  placed_.emplace();
  if (features_.empty()) return;
  {
    std::vector<PhotoPair> pairs = Match(features_);
    placed_ = PlaceBy(features_, pairs);
    if (AreSomeLeft(MayMakeLarger(*placed_, pairs, frames_.size()))) {
      PlaceByMoreMatches(std::move(pairs));
    }
  }
  // Where all features that there are were found, as on a blank wall or a title, more do not come.
  std::vector<bool> have_more_features;
  for (const PhotoFeatures& features : features_) {
    have_more_features.push_back(features.size() >=
                                 static_cast<std::size_t>(options_.num_features));
  }
  features_.clear();
  if (AreSomeLeft(have_more_features)) PlaceByMoreFeatures();
  for (PhotoMap& map : placed_->maps) {
    for (std::size_t i = 0; i < map.photos.size(); ++i) {
      const Frame& frame = frames_[map.photos[i].photo];
      map.sparse.images[i].id = frame.index;
      map.sparse.images[i].name = frame.name;
    }
  }
}

// True when a map has moved.
bool PhotoTracker::FollowNewPositions() {
  bool has_moved = false;
  for (std::size_t i = 0; i < placed_->maps.size(); ++i) {
    std::optional<CameraPositions> positions = positions_.TakeDue(static_cast<int>(i));
    if (!positions) continue;
    const ScopedStageTimer timer(times_, "tracking/positions");
    PhotoMap& map = placed_->maps[i];
    const std::optional<PositionFit> fit = AdjustToEarth(map.sparse, *positions);
    if (!fit) continue;
    positions_.SetFit(*fit, positions->S_metric_map);
    for (std::size_t k = 0; k < map.photos.size(); ++k) {
      map.photos[k].T_world_cam = map.sparse.images[k].T_world_cam;
    }
    has_moved = true;
  }
  return has_moved;
}

void PhotoTracker::WaitForMapping() {
  const bool is_new = !placed_;
  Place();
  if (FollowNewPositions() || is_new) Publish();
}

// What others are told of where the photos are.
void PhotoTracker::Publish() {
  trajectory_.clear();
  sparse_.clear();
  std::vector<KeyframePose> poses;
  for (std::size_t i = 0; i < placed_->maps.size(); ++i) {
    const auto map_id = static_cast<int>(i);
    for (const PlacedPhoto& photo : placed_->maps[i].photos) {
      const Frame& frame = frames_[photo.photo];
      poses.push_back(
          {static_cast<std::int64_t>(poses.size()), map_id, Similarity(1, photo.T_world_cam)});
      trajectory_.push_back({frame.index, frame.timestamp_s, map_id, photo.T_world_cam});
    }
    sparse_.push_back(placed_->maps[i].sparse);
    std::ranges::sort(sparse_.back().images, {}, &SparseImage::id);
  }
  std::ranges::sort(trajectory_, {}, &TrajectoryEntry::frame_index);
  const std::lock_guard lock(mutex_);
  poses_ = std::make_shared<const KeyframePoses>(poses_->version() + 1, std::move(poses));
}

std::vector<Keyframe> PhotoTracker::Finish() {
  WaitForMapping();
  std::vector<Keyframe> keyframes;
  for (const PhotoMap& map : placed_->maps) {
    for (std::size_t i = 0; i < map.photos.size(); ++i) {
      const Frame& frame = frames_[map.photos[i].photo];
      const auto id = static_cast<std::int64_t>(keyframes.size());
      keyframes.push_back(KeyframeOfPhoto(frame, id, map.sparse.images[i], map.sparse));
      late_results_.push_back(
          {frame.index, FramePose{frame.index, frame.timestamp_s, id, Pose()}, {}});
    }
  }
  constexpr int kMaxNamed = 10;  // of hundreds the first ones are enough; LateResults has all
  int num_without_pose = 0;
  for (std::size_t i = 0; i < placed_->reasons.size(); ++i) {
    if (placed_->reasons[i].empty()) continue;
    if (++num_without_pose <= kMaxNamed) {
      Log(LogLevel::kWarning, frames_[i].name + " has no pose: " + placed_->reasons[i]);
    }
    late_results_.push_back({frames_[i].index, std::nullopt, placed_->reasons[i]});
  }
  if (num_without_pose > kMaxNamed) {
    Log(LogLevel::kWarning,
        std::to_string(num_without_pose - kMaxNamed) + " more photographs have no pose");
  }
  frames_.clear();
  placed_.emplace();
  return keyframes;
}

void PhotoTracker::BringInOrder() {
  std::vector<Frame> frames;
  std::vector<PhotoFeatures> features;
  for (const std::size_t photo : OrderOfContent(features_)) {
    frames.push_back(std::move(frames_[photo]));
    features.push_back(std::move(features_[photo]));
  }
  frames_ = std::move(frames);
  features_ = std::move(features);
}

SparseModel PhotoTracker::Sparse(int map_id) const {
  const bool is_known = map_id >= 0 && static_cast<std::size_t>(map_id) < sparse_.size();
  return is_known ? sparse_[static_cast<std::size_t>(map_id)] : SparseModel{};
}

}  // namespace mono3d::tracking

namespace mono3d {

void PhotoMapperOptions::Visit(OptionVisitor& visit) {
  visit("num_features", num_features,
        "SIFT features per photo; twice as many where photos do not hang together");
  visit("max_side_px", max_side_px,
        "larger photos are matched on smaller ones of this longer side");
  visit("max_exhaustive", max_exhaustive, "up to so many photos each is matched with each");
  visit("num_partners", num_partners, "of more, those that each is matched with");
  visit("min_matches", min_matches, "matches of two photos that one epipolar geometry explains");
  visit("min_inliers", min_inliers, "scene points that the pose of a photo must rest on");
  visit("min_parallax_deg", min_parallax_deg, "largest angle at which photos see a scene point");
  visit("max_starts", max_starts, "pairs of photos that are tried as the start of a map");
  visit("seed", seed, "seed of RANSAC");
}

void PhotoMapperOptions::Validate() const {
  RequireOption(num_features >= 100, "photos.num_features", "100 or more", num_features);
  RequireOption(max_side_px >= 64, "photos.max_side_px", "64 or more", max_side_px);
  RequireOption(max_exhaustive >= 0, "photos.max_exhaustive", "0 or more", max_exhaustive);
  RequireOption(num_partners >= 1, "photos.num_partners", "1 or more", num_partners);
  RequireOption(min_matches >= 8, "photos.min_matches", "8 or more", min_matches);
  RequireOption(min_inliers >= 10, "photos.min_inliers", "10 or more", min_inliers);
  RequireOption(min_parallax_deg > 0 && min_parallax_deg < 90, "photos.min_parallax_deg",
                "more than 0, less than 90", min_parallax_deg);
  RequireOption(max_starts >= 1, "photos.max_starts", "1 or more", max_starts);
}

std::unique_ptr<Tracker> CreatePhotoMapper(const PhotoMapperOptions& options, StageTimes* times) {
  return std::make_unique<tracking::PhotoTracker>(options, times);
}

}  // namespace mono3d
