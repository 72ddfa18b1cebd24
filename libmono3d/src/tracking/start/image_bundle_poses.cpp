// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/image_bundle_poses.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/geometry/triangulation.h"
#include "mono3d/image/keyframe.h"
#include "tracking/features/feature_extraction.h"
#include "tracking/features/feature_grid.h"
#include "tracking/features/matching.h"
#include "tracking/map/sparse_export.h"
#include "tracking/start/image_bundle_map.h"
#include "tracking/start/two_view_start.h"

namespace mono3d {
namespace tracking {
namespace {

constexpr std::size_t kMinFrames = 3;  // two views of a plane leave two motions open
// A map speaks for its motion if no other one has more than this share of its score.
constexpr double kClearScoreShare = 0.9;

// The motions that one pair of views leaves open.
struct StartPair {
  std::size_t a = 0;
  std::size_t b = 0;
  StartAttempt attempt;
  double score = 0;  // see ScoreOfMotion
};

void ValidateFrames(std::span<const Frame> frames) {
  if (frames.size() < kMinFrames) {
    throw Error(ErrorParts{.what = "too few images to estimate their poses",
                           .where = {},
                           .expected = std::to_string(kMinFrames) + " or more",
                           .found = std::to_string(frames.size())});
  }
  for (const Frame& frame : frames) {
    Validate(frame);
    if (frame.camera == frames.front().camera) continue;
    throw Error(ErrorParts{.what = "camera differs from the first image's",
                           .where = frame.name,
                           .expected = "one camera for all images",
                           .found = {}});
  }
}

std::vector<View> MakeBundleViews(std::span<const Frame> frames,
                                  const ImageBundlePosesOptions& options) {
  FeatureOptions features;
  features.num_features = options.num_features;
  std::vector<View> views;
  for (const Frame& frame : frames) {
    View& view = views.emplace_back();
    view.frame = frame;
    view.octaves = BuildOctaves(ToGrey(frame.bgr));
    view.features = ExtractFeatures(view.octaves[0], features, options.num_features);
    view.grid = FeatureGrid(view.features, frame.camera.width, frame.camera.height);
    view.points.resize(view.features.size());
  }
  return views;
}

// Many points under large parallax; beyond ten degrees more of it does not help.
double ScoreOfMotion(const TwoViewStart& motion) {
  constexpr double kEnough = 10 * std::numbers::pi / 180;
  const Eigen::Vector3d centre_b = motion.T_b_a.Inverse().translation();
  double score = 0;
  for (const Eigen::Vector3d& p_a : motion.p_a) {
    const double cosine = CosParallax(p_a, Eigen::Vector3d::Zero(), centre_b);
    score += std::min(std::acos(std::clamp(cosine, -1.0, 1.0)), kEnough);
  }
  return score;
}

StartPair TryPair(const std::vector<View>& views, std::size_t a, std::size_t b,
                  const ImageBundlePosesOptions& options) {
  const auto is_fine = [](const View& view) {
    std::vector<char> fine;
    for (const Feature& feature : view.features)
      fine.push_back(feature.level <= kMaxStartLevel ? 1 : 0);
    return fine;
  };
  InitialisationOptions start;
  start.min_matches = options.min_matches;
  start.min_points = options.min_points;
  start.min_parallax_deg = options.min_parallax_deg;
  const std::vector<FeatureMatch> matches =
      MatchDescriptors(views[a], is_fine(views[a]), views[b], is_fine(views[b]));
  StartPair pair{a, b, {}, 0};
  pair.attempt =
      StartFromTwoViews(views[a], views[b], matches, views[a].frame.camera, start, options.seed);
  if (!pair.attempt.candidates.empty()) pair.score = ScoreOfMotion(pair.attempt.candidates[0]);
  return pair;
}

// All pairs, the most promising first.
std::vector<StartPair> RankPairs(const std::vector<View>& views,
                                 const ImageBundlePosesOptions& options) {
  std::vector<StartPair> pairs;
  for (std::size_t a = 0; a < views.size(); ++a) {
    for (std::size_t b = a + 1; b < views.size(); ++b)
      pairs.push_back(TryPair(views, a, b, options));
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const StartPair& l, const StartPair& r) { return l.score > r.score; });
  return pairs;
}

// The best map from one pair; incomplete, with a reason, where there is none or no clear one.
ImageBundleMap GrowFrom(const StartPair& pair, const std::vector<View>& views,
                        const ImageBundlePosesOptions& options) {
  ImageBundleMap best;
  double second_score = 0;
  for (const TwoViewStart& motion : pair.attempt.candidates) {
    ImageBundleMap grown = GrowMap(views, {pair.a, pair.b, motion}, options);
    if (!grown.IsComplete()) {
      if (best.reason.empty()) best.reason = grown.reason;
      continue;
    }
    second_score = std::max(second_score, std::min(grown.score, best.score));
    if (!best.IsComplete() || grown.score > best.score) best = std::move(grown);
  }
  if (best.IsComplete() && second_score > kClearScoreShare * best.score) {
    best.keyframe_of_view.clear();
    best.reason = "two motions explain the images equally well";
  }
  return best;
}

double ReprojectionRms_px(const SparseModel& model) {
  double sum = 0;
  int count = 0;
  for (const SparseImage& image : model.images) {
    const Pose T_cam_world = image.T_world_cam.Inverse();
    for (const SparseObservation& seen : image.observations) {
      const Eigen::Vector3d p_cam = T_cam_world * model.points[*seen.point].p_world;
      sum += (model.camera.Project(p_cam) - seen.pixel).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

// Brings the map into the frame of the middle view, median depth 1, and hands it out.
ImageBundlePoses ToResult(const ImageBundleMap& grown, std::span<const Frame> frames) {
  const Map& map = *grown.map;
  const View& reference = map.keyframe(grown.keyframe_of_view[frames.size() / 2]).view;
  const Similarity S_ref_map(1 / static_cast<double>(UpperMedianOrZero(map.Depths(reference))),
                             Pose());
  const Similarity S_world_map = S_ref_map * Similarity(1, reference.T_cam_world);
  ImageBundlePoses result;
  result.is_estimated = true;
  const SparseModel model = ToSparseModel(map);  // by keyframes, the order in which they were added
  result.model.camera = model.camera;
  result.model.points = model.points;
  for (SparsePoint& point : result.model.points) point.p_world = S_world_map * point.p_world;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const View& view = map.keyframe(grown.keyframe_of_view[i]).view;
    SparseImage& image = result.model.images.emplace_back(model.images[grown.keyframe_of_view[i]]);
    image.id = static_cast<std::int64_t>(i);
    image.T_world_cam = S_world_map * image.T_world_cam;
    Keyframe& keyframe = result.keyframes.emplace_back();
    keyframe.id = static_cast<std::int64_t>(i);
    keyframe.frame = frames[i];
    result.T_world_cam.push_back(image.T_world_cam);
    for (const float depth : map.Depths(view)) {
      keyframe.sparse_depths_su.push_back(static_cast<float>(S_ref_map.scale()) * depth);
    }
  }
  result.reprojection_px = ReprojectionRms_px(result.model);
  return result;
}

}  // namespace
}  // namespace tracking

void ImageBundlePosesOptions::Visit(OptionVisitor& visit) {
  visit("num_features", num_features, "ORB features per image");
  visit("min_matches", min_matches, "matches between the two images of the start");
  visit("min_points", min_points, "points triangulated from them");
  visit("min_parallax_deg", min_parallax_deg, "parallax of the 50th best point of the start");
  visit("min_inliers", min_inliers, "scene points that the pose of every further image rests on");
  visit("max_starts", max_starts, "pairs of images that are tried as start");
  visit("seed", seed, "seed of RANSAC");
}

void ImageBundlePosesOptions::Validate() const {
  RequireOption(num_features >= 100, "poses.num_features", "100 or more", num_features);
  RequireOption(min_matches >= 8, "poses.min_matches", "8 or more", min_matches);
  RequireOption(min_points >= 8, "poses.min_points", "8 or more", min_points);
  RequireOption(min_parallax_deg > 0, "poses.min_parallax_deg", "more than 0", min_parallax_deg);
  RequireOption(min_inliers >= 10, "poses.min_inliers", "10 or more", min_inliers);
  RequireOption(max_starts >= 1, "poses.max_starts", "1 or more", max_starts);
}

ImageBundlePoses EstimateImageBundlePoses(std::span<const Frame> frames,
                                          const ImageBundlePosesOptions& options,
                                          StageTimes* times) {
  options.Validate();
  tracking::ValidateFrames(frames);
  const ScopedStageTimer timer(times, "tracking/image_bundle_poses");
  const std::vector<tracking::View> views = tracking::MakeBundleViews(frames, options);
  const std::vector<tracking::StartPair> pairs = tracking::RankPairs(views, options);
  ImageBundlePoses failed;
  for (std::size_t i = 0; i < pairs.size() && static_cast<int>(i) < options.max_starts; ++i) {
    if (pairs[i].attempt.candidates.empty()) break;
    const tracking::ImageBundleMap grown = tracking::GrowFrom(pairs[i], views, options);
    if (grown.IsComplete()) return tracking::ToResult(grown, frames);
    if (failed.reason.empty()) failed.reason = grown.reason;
  }
  if (failed.reason.empty()) {
    failed.reason = "no two images make a start: " + pairs.front().attempt.reason;
  }
  return failed;
}

}  // namespace mono3d
