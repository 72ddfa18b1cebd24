// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/photo_mapper.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/similarity.h"
#include "tracking/photos/photo_features.h"
#include "tracking/photos/photo_mapping.h"
#include "tracking/photos/photo_matching.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr double kRadius = 10;

// Photographs of houses in an arc, 10 degrees and 17 % of the depth apart; every third camera is
// held upright, so that its picture is turned by 90 degrees.
struct PhotoSet {
  std::vector<Frame> frames;
  std::vector<Pose> T_world_cam;  // the truth
};

PhotoSet TakeInArc() {
  constexpr int kNumPhotos = 9;
  constexpr double kStep = 10 * std::numbers::pi / 180;
  const TexturedGround ground(true);
  const Pose upright(RotationExp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d::Zero());
  PhotoSet photos;
  for (int i = 0; i < kNumPhotos; ++i) {
    const double angle = kStep * (i - kNumPhotos / 2);
    const Eigen::Vector3d target(8, 8, 0);
    const Eigen::Vector3d eye =
        target + kRadius * Eigen::Vector3d(std::sin(angle), -std::cos(angle), 1);
    const Pose level = LookAt(eye, target);
    photos.T_world_cam.push_back(i % 3 == 1 ? level * upright : level);
    Frame frame = BlackFrame(i);
    frame.name = "photo " + std::to_string(i);
    frame.bgr = ground.Render(frame.camera, photos.T_world_cam.back());
    photos.frames.push_back(frame);
  }
  return photos;
}

const PhotoSet& Houses() {
  static const PhotoSet photos = TakeInArc();
  return photos;
}

// In the order of the list; the frames keep their indices.
struct Placed {
  std::vector<Keyframe> keyframes;
  std::vector<LateResult> late;
  std::map<std::int64_t, Pose> T_world_cam;  // by the frame's index
  std::map<std::int64_t, int> map_id;
  SparseModel sparse;
};

Placed Place(const std::vector<Frame>& frames, const PhotoMapperOptions& options = {}) {
  const std::unique_ptr<Tracker> mapper = CreatePhotoMapper(options);
  for (const Frame& frame : frames) {
    const TrackingResult result = mapper->Track(frame);
    EXPECT_TRUE(result.is_pending);
    EXPECT_FALSE(result.T_world_cam);
  }
  Placed placed;
  placed.keyframes = mapper->Finish();
  placed.late = mapper->LateResults();
  for (const TrajectoryEntry& entry : mapper->Trajectory()) {
    placed.T_world_cam.emplace(entry.frame_index, entry.T_world_cam);
    placed.map_id.emplace(entry.frame_index, entry.map_id);
  }
  for (const Keyframe& keyframe : placed.keyframes) {
    EXPECT_NE(mapper->Poses()->Find(keyframe.id), nullptr);
  }
  placed.sparse = mapper->Sparse(0);
  return placed;
}

std::vector<Frame> Shuffled(std::vector<Frame> frames, unsigned seed) {
  std::mt19937 random(seed);
  for (std::size_t i = frames.size(); i > 1; --i) std::swap(frames[i - 1], frames[random() % i]);
  return frames;
}

const Placed& PlacedHouses() {
  static const Placed placed = Place(Shuffled(Houses().frames, 5));
  return placed;
}

// Round blobs: there is no doubt where they are.
TEST(PhotoFeatures, AreWhereTheStructuresAre) {
  const Eigen::Vector2d centre(120.3, 130.6);
  for (const double radius : {2.0, 4.0}) {
    cv::Mat bgr(256, 256, CV_8UC3);
    for (int y = 0; y < bgr.rows; ++y) {
      for (int x = 0; x < bgr.cols; ++x) {
        const double squared = (Eigen::Vector2d(x, y) - centre).squaredNorm();
        const double grey = 40 + 180 * std::exp(-squared / (2 * radius * radius));
        bgr.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(grey));
      }
    }
    const PhotoFeatures features = ExtractPhotoFeatures(bgr, 100, 1000);
    ASSERT_GT(features.size(), 0U);
    for (const Eigen::Vector2d& pixel : features.pixels) EXPECT_LT((pixel - centre).norm(), 0.1);
  }
}

// At a seventh of the light, with the noise that comes with it.
TEST(PhotoFeatures, OfADarkPictureAreThoseOfTheBrightOne) {
  const cv::Mat& bright = Houses().frames[0].bgr;
  cv::Mat noise(bright.size(), CV_32FC3);
  cv::RNG(3).fill(noise, cv::RNG::NORMAL, 0, 0.6);
  cv::Mat dark;
  bright.convertTo(dark, CV_32FC3, 1. / 7);
  dark += noise;
  dark.convertTo(dark, CV_8UC3);
  const PhotoFeatures of_bright = ExtractPhotoFeatures(bright, 1000, 1000);
  const PhotoFeatures of_dark = ExtractPhotoFeatures(dark, 1000, 1000);
  const auto matches = MatchPhotoFeatures(of_bright, of_dark, 1000);
  EXPECT_GT(static_cast<double>(matches.size()), 0.6 * static_cast<double>(of_bright.size()))
      << of_bright.size() << ", " << of_dark.size() << " in the dark";
}

TEST(PhotoFeatures, AreNotMadeOfNoise) {
  for (const double sigma : {0.3, 1.0, 3.0}) {
    cv::Mat noise(200, 300, CV_32FC3, cv::Scalar::all(20));
    cv::RNG(3).fill(noise, cv::RNG::NORMAL, 20, sigma);
    cv::Mat bgr;
    noise.convertTo(bgr, CV_8UC3);
    EXPECT_LT(ExtractPhotoFeatures(bgr, 1000, 1000).size(), 10U) << sigma;
  }
}

// Root mean square distance from the truth after alignment.
double ErrorOfFrames(const Placed& placed, const Sequence& sequence) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const auto& [index, T_world_cam] : placed.T_world_cam) {
    found.push_back(T_world_cam.translation());
    truth.push_back(sequence.T_world_cam[static_cast<std::size_t>(index)].translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += (fit * found[i] - truth[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(found.size()));
}

TEST(PhotoMapper, FollowsTheShutterOfFramesOfAVideo) {
  CameraModel sensor = SmallCamera();
  sensor.shutter = {0.03, false};
  const TexturedGround ground(true);
  const Sequence sequence = FlyUnsteadily(ground, sensor, 40);
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < sequence.frames.size(); i += 2) frames.push_back(sequence.frames[i]);
  PhotoMapperOptions options;
  options.are_frames = true;
  const Placed followed = Place(Shuffled(frames, 3), options);
  const Placed as_photos = Place(Shuffled(frames, 3));
  ASSERT_THAT(followed.T_world_cam, SizeIs(frames.size()));
  ASSERT_THAT(as_photos.T_world_cam, SizeIs(frames.size()));
  EXPECT_LT(ErrorOfFrames(followed, sequence), 0.5 * ErrorOfFrames(as_photos, sequence));
  ASSERT_THAT(followed.keyframes, SizeIs(frames.size()));
  for (const Keyframe& keyframe : followed.keyframes) {
    EXPECT_FALSE(keyframe.velocity == CameraVelocity());
    EXPECT_EQ(keyframe.sparse_pixels.size(), keyframe.sparse_depths_su.size());
  }
  for (const SparseImage& image : followed.sparse.images) EXPECT_TRUE(image.velocity.has_value());
  for (const SparseImage& image : as_photos.sparse.images) EXPECT_FALSE(image.velocity.has_value());
}

TEST(PhotoMapper, AGlobalShutterIsNotFollowed) {
  PhotoMapperOptions options;
  options.are_frames = true;
  const Placed placed = Place(Shuffled(Houses().frames, 5), options);
  ASSERT_THAT(placed.T_world_cam, SizeIs(Houses().frames.size()));
  for (const auto& [index, T_world_cam] : placed.T_world_cam) {
    EXPECT_EQ(T_world_cam.translation(), PlacedHouses().T_world_cam.at(index).translation());
  }
  // Who calibrates asks how they moved.
  for (const SparseImage& image : placed.sparse.images) EXPECT_TRUE(image.velocity.has_value());
}

TEST(PhotoMapper, PlacesPhotosInAnyOrder) {
  const Placed& placed = PlacedHouses();
  ASSERT_THAT(placed.T_world_cam, SizeIs(Houses().frames.size()));
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> expected;
  for (std::size_t i = 0; i < Houses().frames.size(); ++i) {
    found.push_back(placed.T_world_cam.at(static_cast<std::int64_t>(i)).translation());
    expected.push_back(Houses().T_world_cam[i].translation());
  }
  const Similarity fit = FitSimilarity(found, expected);
  // Some hundred points found to half a pixel at 345 px of focal length leave 0.01 % of the depth;
  // the renderer samples a texture without smoothing, which costs some times that.
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT((fit * found[i] - expected[i]).norm(), 0.001 * std::sqrt(2) * kRadius) << i;
    const Pose pose = fit * placed.T_world_cam.at(static_cast<std::int64_t>(i));
    const double angle = (pose.Inverse() * Houses().T_world_cam[i]).RotationAngle();
    // That of the positions tilts all of them as well.
    EXPECT_LT(angle * 180 / std::numbers::pi, 0.2) << i;
  }
}

TEST(PhotoMapper, DoesNotDependOnOrderNamesAndTimes) {
  std::vector<Frame> renamed = Shuffled(Houses().frames, 8);
  for (Frame& frame : renamed) {
    frame.name = "DSC" + std::to_string(1000 - 7 * frame.index % 11);
    frame.timestamp_s = 9 * static_cast<double>(frame.index % 4);
  }
  const Placed again = Place(renamed);
  ASSERT_THAT(again.T_world_cam, SizeIs(PlacedHouses().T_world_cam.size()));
  for (const auto& [index, pose] : PlacedHouses().T_world_cam) {
    EXPECT_EQ(pose.Matrix(), again.T_world_cam.at(index).Matrix()) << index;
  }
}

TEST(PhotoMapper, HandsOutKeyframesWithThePointsThatTheyShow) {
  const Placed& placed = PlacedHouses();
  ASSERT_THAT(placed.keyframes, SizeIs(Houses().frames.size()));
  EXPECT_NO_THROW(Validate(placed.sparse));
  EXPECT_THAT(placed.sparse.images, SizeIs(Houses().frames.size()));
  for (const Keyframe& keyframe : placed.keyframes) {
    EXPECT_GT(keyframe.sparse_depths_su.size(), 50U) << keyframe.frame.name;
    EXPECT_EQ(keyframe.sparse_depths_su.size(), keyframe.sparse_pixels.size());
    EXPECT_FALSE(keyframe.frame.bgr.empty());
    for (const float depth : keyframe.sparse_depths_su) EXPECT_GT(depth, 0);
  }
  const std::vector<double> errors_px = ReprojectionErrors_px(placed.sparse);
  EXPECT_LT(*std::ranges::max_element(errors_px), 3);
}

using PlacingStep = PhotoMapperProgress::Step;

TEST(PhotoMapper, TellsHowFarItIs) {
  std::map<PlacingStep, std::vector<PhotoMapperProgress>> told;
  PhotoMapperOptions options;
  options.on_progress = [&](const PhotoMapperProgress& progress) {
    told[progress.step].push_back(progress);
  };
  (void)Place(Houses().frames, options);
  const auto num_photos = static_cast<std::int64_t>(Houses().frames.size());
  ASSERT_THAT(told[PlacingStep::kMatching], SizeIs(num_photos * (num_photos - 1) / 2));
  for (std::size_t i = 0; i < told[PlacingStep::kMatching].size(); ++i) {
    EXPECT_EQ(told[PlacingStep::kMatching][i].done, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(told[PlacingStep::kMatching][i].total, std::ssize(told[PlacingStep::kMatching]));
  }
  ASSERT_FALSE(told[PlacingStep::kPlacing].empty());
  EXPECT_EQ(told[PlacingStep::kPlacing].front().done, 2);
  EXPECT_EQ(told[PlacingStep::kPlacing].back().done, num_photos);
  EXPECT_EQ(told[PlacingStep::kPlacing].back().total, num_photos);
}

// Stops once `step` has come so far.
Placed PlaceUntil(PlacingStep step, std::int64_t done) {
  std::atomic<bool> stop = false;
  PhotoMapperOptions options;
  options.stop = &stop;
  options.on_progress = [&](const PhotoMapperProgress& progress) {
    if (progress.step == step && progress.done >= done) stop = true;
  };
  return Place(Houses().frames, options);
}

TEST(PhotoMapper, StoppedWhileItPlacesHasThoseSoFar) {
  const Placed placed = PlaceUntil(PlacingStep::kPlacing, 4);
  EXPECT_GE(placed.T_world_cam.size(), 4U);
  EXPECT_LT(placed.T_world_cam.size(), Houses().frames.size());
  EXPECT_THAT(placed.keyframes, SizeIs(placed.T_world_cam.size()));
  for (const LateResult& late : placed.late) {
    EXPECT_EQ(late.reason, late.pose ? "" : "stopped before it was placed");
  }
  EXPECT_THAT(placed.late, SizeIs(Houses().frames.size()));
}

TEST(PhotoMapper, StoppedWhileItMatchesPlacesNothing) {
  const Placed placed = PlaceUntil(PlacingStep::kMatching, 10);
  EXPECT_THAT(placed.T_world_cam, IsEmpty());
  EXPECT_THAT(placed.late, SizeIs(Houses().frames.size()));
}

TEST(PhotoMapper, ReportsPhotosOfSomethingElse) {
  std::vector<Frame> frames = Houses().frames;
  for (int i = 0; i < 2; ++i) {
    Frame frame = BlackFrame(100 + i);
    frame.name = "other " + std::to_string(i);
    const cv::Mat grey = TexturedPicture(frame.camera.width, frame.camera.height, 31U + i);
    cv::merge(std::vector<cv::Mat>{grey, grey, grey}, frame.bgr);
    frames.push_back(frame);
  }
  const Placed placed = Place(Shuffled(frames, 3));
  EXPECT_THAT(placed.T_world_cam, SizeIs(Houses().frames.size()));
  int num_unplaced = 0;
  for (const LateResult& late : placed.late) {
    if (late.pose) {
      EXPECT_THAT(late.reason, IsEmpty());
      continue;
    }
    ++num_unplaced;
    EXPECT_GE(late.frame_index, 100);
    EXPECT_THAT(late.reason, HasSubstr("no "));
  }
  EXPECT_EQ(num_unplaced, 2);
  EXPECT_THAT(placed.late, SizeIs(frames.size()));
}

enum class Matches { kByLooks, kAlongEpipolarLines };

// How many of the photos hang together by so many features of each.
std::size_t NumHeldBy(const std::vector<Frame>& frames, const PhotoMapperOptions& options,
                      Matches matches) {
  std::vector<PhotoFeatures> features;
  for (const Frame& frame : frames) {
    features.push_back(ExtractPhotoFeatures(frame, options.num_features, options.max_side_px));
  }
  std::vector<PhotoPair> pairs = MatchPhotos(features, options);
  if (matches == Matches::kAlongEpipolarLines) {
    pairs = MatchAlongEpipolarLines(features, std::move(pairs), options);
  }
  const PhotoMaps maps = MapPhotos(features, pairs, frames.front().camera, options);
  return maps.maps.empty() ? 0 : maps.maps.front().photos.size();
}

TEST(PhotoMapper, TakesMoreMatchesWherePhotosDoNotHangTogether) {
  PhotoMapperOptions options;
  options.num_features = 150;
  ASSERT_LT(NumHeldBy(Houses().frames, options, Matches::kByLooks), Houses().frames.size());
  EXPECT_EQ(NumHeldBy(Houses().frames, options, Matches::kAlongEpipolarLines),
            Houses().frames.size());
  EXPECT_THAT(Place(Shuffled(Houses().frames, 5), options).T_world_cam,
              SizeIs(Houses().frames.size()));
}

TEST(PhotoMapper, TakesMoreFeaturesWherePhotosDoNotHangTogether) {
  PhotoMapperOptions options;
  options.num_features = 110;
  ASSERT_LT(NumHeldBy(Houses().frames, options, Matches::kAlongEpipolarLines),
            Houses().frames.size());
  EXPECT_THAT(Place(Shuffled(Houses().frames, 5), options).T_world_cam,
              SizeIs(Houses().frames.size()));
}

// Titles between the shots of a film: what is not there is not looked for again, which would take
// several times as long as all before.
TEST(PhotoMapper, PlacesOnceWhereWhatIsLeftShowsNothing) {
  PhotoMapperOptions options;
  options.num_features = 300;
  std::vector<Frame> frames = Houses().frames;
  for (int i = 0; i < 3; ++i) {
    Frame frame = BlackFrame(300 + i);
    frame.name = "title " + std::to_string(i);
    cv::putText(frame.bgr, "summer", {60, 90}, cv::FONT_HERSHEY_SIMPLEX, 1, {255, 255, 255}, 2);
    frames.push_back(frame);
  }
  StageTimes times;
  const std::unique_ptr<Tracker> mapper = CreatePhotoMapper(options, &times);
  for (const Frame& frame : frames) (void)mapper->Track(frame);
  (void)mapper->Finish();
  EXPECT_THAT(mapper->Trajectory(), SizeIs(Houses().frames.size()));
  for (const StageTime& stage : times.Snapshot()) {
    const bool is_mapping = stage.stage == "tracking/photo_mapping";
    if (!is_mapping && stage.stage != "tracking/photo_features") continue;
    EXPECT_EQ(stage.num_calls, is_mapping ? 1 : static_cast<std::int64_t>(frames.size()))
        << stage.stage;
  }
}

// Place recognition instead of all pairs: the same photos hang together.
TEST(PhotoMapper, FindsPhotosThatLookAlikeAmongMany) {
  PhotoMapperOptions options;
  options.max_exhaustive = 4;
  options.num_partners = 4;
  EXPECT_THAT(Place(Houses().frames, options).T_world_cam, SizeIs(Houses().frames.size()));
}

TEST(PhotoMapper, MakesMapsOfTheirOwnOfPartsWithNothingInCommon) {
  std::vector<Frame> frames = Houses().frames;
  const TexturedGround meadow(false);
  for (int i = 0; i < 4; ++i) {
    Frame frame = BlackFrame(200 + i);
    // Away from where the houses are, and upside down, at another height.
    const Eigen::Vector3d eye(25 + 1.5 * i, 27, 6 + 0.5 * (i % 2));
    frame.bgr = meadow.Render(frame.camera, LookAt(eye, {25 + 1.2 * i, 31, 0}));
    frame.name = "meadow " + std::to_string(i);
    frames.push_back(frame);
  }
  const Placed placed = Place(frames);
  for (const auto& [index, map_id] : placed.map_id) EXPECT_EQ(map_id, index < 200 ? 0 : 1);
  EXPECT_THAT(placed.sparse.images, SizeIs(Houses().frames.size()));
}

TEST(PhotoMapper, SaysWhyThereIsNoMap) {
  const Placed placed = Place({Houses().frames[0], Houses().frames[8]});
  EXPECT_THAT(placed.keyframes, IsEmpty());
  ASSERT_THAT(placed.late, SizeIs(2));
  for (const LateResult& late : placed.late) EXPECT_FALSE(late.reason.empty());
  EXPECT_THAT(Place({}).keyframes, IsEmpty());
}

TEST(PhotoMapper, NamesTheFirstOfManyPhotosWithoutAPose) {
  std::vector<Frame> frames;
  for (int i = 0; i < 14; ++i) frames.push_back(BlackFrame(i));
  std::vector<std::string> lines;
  SetLogSink([&](LogLevel level, std::string_view message) {
    if (level == LogLevel::kWarning) lines.emplace_back(message);
  });
  const Placed placed = Place(frames);
  SetLogSink({});
  EXPECT_THAT(placed.late, SizeIs(14));
  ASSERT_THAT(lines, SizeIs(11));
  EXPECT_THAT(lines.front(), HasSubstr("has no pose: "));
  EXPECT_EQ(lines.back(), "4 more photographs have no pose");
}

TEST(PhotoMapper, RefusesPhotosOfAnotherCamera) {
  const std::unique_ptr<Tracker> mapper = CreatePhotoMapper();
  (void)mapper->Track(Houses().frames[0]);
  Frame other = Houses().frames[1];
  other.camera.fx += 1;
  EXPECT_THROW((void)mapper->Track(other), Error);
}

TEST(PhotoMapperOptions, RefuseWhatMakesNoSense) {
  PhotoMapperOptions options;
  EXPECT_NO_THROW(options.Validate());
  options.num_features = 10;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.min_parallax_deg = 0;
  EXPECT_THROW(options.Validate(), UsageError);
}

// Seen in a mirror a place is another one.
TEST(ShowTheSame, WhereImagesOfTwoGroupsShareAPlace) {
  const auto in_group = [](std::size_t group, std::size_t number, bool is_mirrored = false) {
    return GroupedImage{group, [number, is_mirrored] {
                          Frame frame = Houses().frames[number];
                          if (is_mirrored) cv::flip(frame.bgr, frame.bgr, 1);
                          return std::optional<Frame>(frame);
                        }};
  };
  const GroupedImage cannot_be_read{1, [] { return std::optional<Frame>(); }};
  EXPECT_TRUE(ShowTheSame(std::vector{in_group(0, 0), in_group(1, 8), in_group(1, 1)}));
  EXPECT_FALSE(ShowTheSame(std::vector{in_group(0, 0), in_group(0, 1), in_group(1, 0, true)}));
  EXPECT_FALSE(ShowTheSame(std::vector{in_group(0, 0), in_group(0, 1), cannot_be_read}));
}

TEST(Continuity, TellsAVideoFromPhotographs) {
  const TexturedGround ground(true);
  const Sequence video = FlyOver(ground, 2);
  EXPECT_GT(ContinuityOf(video.frames[0].bgr, video.frames[1].bgr).value(), 0.5);
  EXPECT_LT(ContinuityOf(Houses().frames[0].bgr, Houses().frames[2].bgr).value(), 0.4);
  EXPECT_LT(ContinuityOf(Houses().frames[0].bgr, Houses().frames[8].bgr).value(), 0.1);
  EXPECT_FALSE(ContinuityOf(BlackFrame(0).bgr, BlackFrame(1).bgr));
}

}  // namespace
}  // namespace mono3d::tracking
