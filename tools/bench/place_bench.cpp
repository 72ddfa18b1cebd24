// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/place_bench.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "bench/place_truth.h"
#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/trajectory_error.h"
#include "mono3d/io/camera_file.h"

namespace mono3d::tools {
namespace {

constexpr double kMinShare = 0.5;  // of the surface that a revisit shares
// A right place: the camera is off by less than these shares of the mean depth, degrees, and share
// of the scale. Poses of the same place are ten times as good, those of another are anywhere.
constexpr double kMaxPositionError = 0.02;
constexpr double kMaxRotationError_deg = 2;
constexpr double kMaxScaleError = 0.02;

CameraModel CameraOf(const std::string& folder) {
  return ReadCameraFile((std::filesystem::path(folder) / "camera.yaml").string());
}

// Part of a sequence, as if it came from the map's camera.
class Footage {
 public:
  Footage(std::string folder, FrameSourceOptions source, std::optional<CameraModel> camera)
      : folder_(std::move(folder)), options_(std::move(source)), camera_(std::move(camera)) {}

  template <typename Use>
  void ForEach(const Use& use) const {
    const auto source = OpenFrameSource(folder_, CameraOf(folder_), options_);
    while (std::optional<Frame> frame = source->Next()) {
      if (camera_ && !(frame->camera == *camera_)) {
        cv::resize(frame->bgr, frame->bgr, cv::Size(camera_->width, camera_->height), 0, 0,
                   cv::INTER_AREA);
        frame->camera = *camera_;
      }
      use(*frame);
    }
  }

 private:
  std::string folder_;
  FrameSourceOptions options_;
  std::optional<CameraModel> camera_;
};

// Nothing where tracking did not start.
std::optional<SavedPlaces> MapOf(const Footage& footage, const TrackerOptions& options) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  bool has_map = false;
  footage.ForEach([&](const Frame& frame) {
    has_map = tracker->Track(frame).T_world_cam.has_value() || has_map;
  });
  static_cast<void>(tracker->WaitForMapping());
  static_cast<void>(tracker->Finish());
  if (!has_map) return std::nullopt;
  return SavedPlaces(tracker->SaveMap(), "map", options);
}

// Aligns the keyframes of a map to the truth; images are numbered by the sequence.
TrajectoryError Align(const std::vector<TrajectoryEntry>& keyframes, const PlaceTruth& truth) {
  std::vector<StampedPose> found;
  std::vector<StampedPose> expected;
  for (const TrajectoryEntry& keyframe : keyframes) {
    const auto time_s = static_cast<double>(keyframe.frame_index);
    found.push_back({time_s, keyframe.T_world_cam});
    expected.push_back({time_s, truth.T_world_cam(keyframe.frame_index)});
  }
  return CompareTrajectories(found, expected);
}

// The map that is asked, what it is in truth, and the judge of its answers.
class Judge {
 public:
  Judge(const PlaceTruth& truth, const SavedPlaces& places)
      : truth_(truth), keyframes_(places.Keyframes()), alignment_(Align(keyframes_, truth)) {}

  const TrajectoryError& alignment() const { return alignment_; }

  PlaceClass ClassOf(std::int64_t image) const {
    if (Share(image, Closest(image, 10), 10) >= kMinShare) return PlaceClass::kWithin10;
    if (Share(image, Closest(image, 20), 20) >= kMinShare) return PlaceClass::kWithin20;
    if (Share(image, Closest(image, kMaxAngle_deg), kMaxAngle_deg) >= kMinShare) {
      return PlaceClass::kWithin30;
    }
    return Share(image, Closest(image, kAny_deg), kAny_deg) > 0 ? PlaceClass::kLess
                                                                : PlaceClass::kElsewhere;
  }

  // `true_scale`: of the places' map over the one that asked, where it has a scale.
  void Count(std::int64_t image, const PlaceRecognition& answer, std::optional<double> true_scale,
             PlaceCounts& counts) const {
    ++counts.num_asked;
    counts.num_proposed += std::any_of(answer.candidates.begin(), answer.candidates.end(),
                                       [&](const PlaceCandidate& candidate) {
                                         return truth_.SharedShare(image, candidate.frame_index,
                                                                   kMaxAngle_deg) >= kMinShare;
                                       })
                               ? 1
                               : 0;
    if (!answer.T_world_cam) return;
    const std::optional<double> error = PositionError(image, *answer.T_world_cam);
    const bool is_scale_right = !answer.scale || !true_scale ||
                                std::abs(std::log(*answer.scale / *true_scale)) <= kMaxScaleError;
    if (!error || !is_scale_right) {
      ++counts.num_wrong;
      return;
    }
    ++counts.num_right;
    counts.sum_squared_error += *error * *error;
  }

 private:
  double Share(std::int64_t image, const TrajectoryEntry& keyframe, double max_angle_deg) const {
    return truth_.SharedShare(image, keyframe.frame_index, max_angle_deg);
  }

  // The keyframe that shares most with the image.
  const TrajectoryEntry& Closest(std::int64_t image, double max_angle_deg) const {
    return *std::max_element(keyframes_.begin(), keyframes_.end(),
                             [&](const TrajectoryEntry& a, const TrajectoryEntry& b) {
                               return Share(image, a, max_angle_deg) <
                                      Share(image, b, max_angle_deg);
                             });
  }

  // Seen from the keyframe that shares most with the image, so that the map's own bend and how a
  // straight one is turned about its line are not in it. Nothing where the pose is wrong.
  std::optional<double> PositionError(std::int64_t image, const Pose& T_world_cam) const {
    const TrajectoryEntry& keyframe = Closest(image, kAny_deg);
    const Pose found = keyframe.T_world_cam.Inverse() * T_world_cam;
    const Pose expected =
        truth_.T_world_cam(keyframe.frame_index).Inverse() * truth_.T_world_cam(image);
    const double error =
        (alignment_.S_truth_estimate.scale() * found.translation() - expected.translation())
            .norm() /
        truth_.MeanDepth(image);
    const double rotation_deg =
        (expected.Inverse() * found).RotationAngle() * 180 / std::numbers::pi;
    if (error > kMaxPositionError || rotation_deg > kMaxRotationError_deg) return std::nullopt;
    return error;
  }

  static constexpr double kAny_deg = 180;
  static constexpr double kMaxAngle_deg = 30;  // to which ORB knows a patch again

  const PlaceTruth& truth_;
  std::vector<TrajectoryEntry> keyframes_;
  TrajectoryError alignment_;
};

std::vector<PlaceCounts> EmptyCounts() {
  std::vector<PlaceCounts> counts;
  for (int i = 0; i <= static_cast<int>(PlaceClass::kElsewhere); ++i) {
    counts.emplace_back().place_class = static_cast<PlaceClass>(i);
  }
  return counts;
}

PlaceCounts& Of(PlaceClass place_class, std::vector<PlaceCounts>& counts) {
  return counts[static_cast<std::size_t>(place_class)];
}

// Hands over each keyframe of a second map, with its image.
template <typename Use>
void ForEachKeyframe(const Footage& footage, const SavedPlaces& map, const Use& use) {
  std::vector<std::int64_t> indices;
  for (const TrajectoryEntry& keyframe : map.Keyframes()) indices.push_back(keyframe.frame_index);
  footage.ForEach([&](const Frame& frame) {
    if (std::find(indices.begin(), indices.end(), frame.index) != indices.end()) use(frame);
  });
}

// Images of the map's own sequence.
void AskOwn(const PlaceBenchOptions& options, const Footage& rest, const PlaceTruth& truth,
            const Judge& judge, SavedPlaces& places, PlaceBenchResult& result) {
  std::int64_t count = 0;
  rest.ForEach([&](const Frame& frame) {
    if (count++ % options.query_stride != 0) return;
    judge.Count(frame.index, places.Relocalise(frame), std::nullopt,
                Of(judge.ClassOf(frame.index), result.images));
  });
  const std::optional<SavedPlaces> second = MapOf(rest, options.tracking);
  if (!second) return;
  const double true_scale = Align(second->Keyframes(), truth).S_truth_estimate.scale() /
                            judge.alignment().S_truth_estimate.scale();
  ForEachKeyframe(rest, *second, [&](const Frame& frame) {
    judge.Count(frame.index, places.Recognise(*second, frame), true_scale,
                Of(judge.ClassOf(frame.index), result.keyframes));
  });
}

// Images of another place: whatever is found is wrong.
void AskOther(const PlaceBenchOptions& options, const std::string& folder, const Footage& footage,
              SavedPlaces& places, PlaceBenchResult& result) {
  PlaceCounts& images = result.images.emplace_back();
  PlaceCounts& keyframes = result.keyframes.emplace_back();
  images.name = keyframes.name = NameOfFolder(folder);
  std::int64_t count = 0;
  footage.ForEach([&](const Frame& frame) {
    if (count++ % options.query_stride != 0) return;
    ++images.num_asked;
    images.num_wrong += places.Relocalise(frame).T_world_cam ? 1 : 0;
  });
  const std::optional<SavedPlaces> second = MapOf(footage, options.tracking);
  if (!second) return;
  ForEachKeyframe(footage, *second, [&](const Frame& frame) {
    ++keyframes.num_asked;
    keyframes.num_wrong += places.Recognise(*second, frame).T_world_cam ? 1 : 0;
  });
}

}  // namespace

PlaceBenchResult BenchPlaces(const PlaceBenchOptions& options) {
  options.source.Validate();
  RequireOption(options.source.stride >= 1, "stride", "a number here: the footage is divided by it",
                options.source.stride);
  options.tracking.Validate();
  const PlaceTruth truth = ReadPlaceTruth(options.folder);
  PlaceBenchResult result;
  result.name = NameOfFolder(options.folder);
  result.split = options.split > 0 ? options.split : truth.num_images() / 2;
  FrameSourceOptions source = options.source;
  source.start = 0;
  source.max_frames = static_cast<int>((result.split + source.stride - 1) / source.stride);
  std::optional<SavedPlaces> places =
      MapOf(Footage(options.folder, source, std::nullopt), options.tracking);
  if (!places) throw Error("tracking did not start in the part that makes the map");
  const Judge judge(truth, *places);
  result.num_keyframes = static_cast<int>(places->Keyframes().size());
  result.map_rmse_m = judge.alignment().position.rmse;
  result.images = result.keyframes = EmptyCounts();
  source.max_frames = 0;
  CameraModel camera;
  Footage(options.folder, {.max_frames = 1, .resize = source.resize}, std::nullopt)
      .ForEach([&](const Frame& frame) { camera = frame.camera; });
  for (const std::string& other : options.others) {
    AskOther(options, other, Footage(other, source, camera), *places, result);
  }
  source.start = static_cast<int>(result.split);
  AskOwn(options, Footage(options.folder, source, camera), truth, judge, *places, result);
  return result;
}

}  // namespace mono3d::tools
