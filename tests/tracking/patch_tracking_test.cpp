// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/patch_tracking.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>
#include <vector>

#include "tracking/alignment/image_alignment.h"
#include "tracking/alignment/image_cells.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/features/feature_extraction.h"
#include "tracking/map/keyframe_handover.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kNumPatchFrames = 6;

const Sequence& PatchMeadow() {
  static const Sequence sequence = FlyOver(TexturedGround(false), kNumPatchFrames);
  return sequence;
}

View ViewOf(int index) {
  View view;
  view.frame = PatchMeadow().frames[static_cast<std::size_t>(index)];
  view.octaves = BuildOctaves(ToGrey(view.frame.bgr));
  view.T_cam_world = PatchMeadow().T_world_cam[static_cast<std::size_t>(index)].Inverse();
  return view;
}

// Where a pixel of a view lies on the ground z = 0.
Eigen::Vector3d PatchOnGround(const View& view, const Eigen::Vector2d& pixel) {
  const Pose T_world_cam = view.T_cam_world.Inverse();
  const Eigen::Vector3d ray = T_world_cam.rotation() * view.frame.camera.Unproject(pixel);
  return T_world_cam.translation() - T_world_cam.translation().z() / ray.z() * ray;
}

// Two keyframes at frames 0 and 1 at their true poses, and true points with patches from frame 0.
Map GroundMap(const FeatureOptions& options = {}) {
  Map map(0, SmallCamera(), options);
  View first = ViewOf(0);
  first.features = ExtractFeatures(first.octaves[0], {}, 600);
  first.points.resize(first.features.size());
  map.AddKeyframe(first);
  View second = ViewOf(1);
  map.AddKeyframe(second);
  for (std::size_t i = 0; i < first.features.size(); ++i) {
    const Eigen::Vector3d p = PatchOnGround(first, first.features[i].pixel);
    Feature in_second = first.features[i];
    in_second.pixel = SmallCamera().Project(second.T_cam_world * p);
    if (!SmallCamera().Contains(in_second.pixel)) continue;
    const PointId point = map.AddPoint(p);
    map.AddObservation(point, {0, i});
    map.AddObservation(point, 1, in_second);
    map.UpdatePoint(point);
    TakePatchOf(map, point, 0, first.features[i]);
  }
  return map;
}

// Of the flying height of 10, and in rad: a twentieth of a pixel of 345.
constexpr double kMaxShift = 0.0015 * 10;
constexpr double kMaxTurn = 0.0015;

void ExpectClose(const Pose& found, const Pose& truth, double factor = 1) {
  EXPECT_LT((found.Inverse().translation() - truth.Inverse().translation()).norm(),
            factor * kMaxShift);
  EXPECT_LT((found * truth.Inverse()).RotationAngle(), factor * kMaxTurn);
}

TEST(AlignImages, FindsTheMotionBetweenTwoImages) {
  const View a = ViewOf(0);
  View b = ViewOf(1);
  std::vector<SeenPoint> points;
  for (const Feature& feature : ExtractFeatures(a.octaves[0], {}, 300)) {
    points.push_back({feature.pixel, a.T_cam_world * PatchOnGround(a, feature.pixel)});
  }
  const Pose truth = b.T_cam_world * a.T_cam_world.Inverse();
  // Half the resolution and facing patches: some times the error of the patches after it.
  ExpectClose(AlignImages(SmallCamera(), a.octaves, points, b.octaves, Pose()), truth, 3);
  // Darker and flatter all over: the same motion.
  View dark = b;
  dark.octaves[0] = 0.7 * b.octaves[0] + 10;
  dark.octaves = BuildOctaves(dark.octaves[0]);
  ExpectClose(AlignImages(SmallCamera(), a.octaves, points, dark.octaves, Pose()), truth, 3);
}

TEST(AlignImages, HandsThePredictionBackWhereThereIsNothingToAlign) {
  const View a = ViewOf(0);
  const Pose prediction(RotationExp({0, 0.01, 0}), {1, 2, 3});
  const Pose none = AlignImages(SmallCamera(), a.octaves, {}, a.octaves, prediction);
  EXPECT_EQ(none.Matrix(), prediction.Matrix());
}

TEST(AlignImages, HandsThePredictionBackWithoutImages) {
  const View a = ViewOf(0);
  const std::vector<SeenPoint> points = {{{100, 100}, {0, 0, 1}}};
  const Pose prediction(RotationExp({0, 0.01, 0}), {1, 2, 3});
  const Octaves none;
  EXPECT_EQ(AlignImages(SmallCamera(), none, points, a.octaves, prediction).Matrix(),
            prediction.Matrix());
  EXPECT_EQ(AlignImages(SmallCamera(), a.octaves, points, none, prediction).Matrix(),
            prediction.Matrix());
}

TEST(TrackDirectly, KnowsPointsNoBetterThanThePatchSigma) {
  FeatureOptions options;
  options.patch_sigma_px = 0.25;
  for (const FeatureOptions& each : {FeatureOptions{}, options}) {
    Map map = GroundMap(each);
    const View previous = map.keyframe(1).view;
    View view = ViewOf(2);
    view.T_cam_world = previous.T_cam_world;
    TrackDirectly(map, previous, view);
    ASSERT_FALSE(view.features.empty());
    double smallest = view.features[0].sigma_px;
    for (const Feature& feature : view.features) {
      smallest = std::min(smallest, static_cast<double>(feature.sigma_px));
    }
    EXPECT_GE(smallest, 0.999 * each.patch_sigma_px);
    EXPECT_LT(smallest, 1.5 * each.patch_sigma_px);  // the image has little noise
  }
}

// What compression, low light and blur do: patches are found elsewhere than they are.
View DisturbedView(int index, double sigma_px) {
  std::mt19937 random(SeedFromTestName());
  View view = ViewOf(index);
  const int width = view.octaves[0].cols;
  const int height = view.octaves[0].rows;
  // A shift that differs from block to block of 12 px, smoothly between them.
  cv::Mat coarse(height / 12 + 1, width / 12 + 1, CV_32FC2);
  for (auto& shift : cv::Mat_<cv::Vec2f>(coarse)) {
    shift = {static_cast<float>(Normal(random, sigma_px)),
             static_cast<float>(Normal(random, sigma_px))};
  }
  cv::Mat map;
  cv::resize(coarse, map, {width, height}, 0, 0, cv::INTER_CUBIC);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      map.at<cv::Vec2f>(y, x) += cv::Vec2f(static_cast<float>(x), static_cast<float>(y));
    }
  }
  cv::Mat disturbed;
  cv::remap(view.octaves[0], disturbed, map, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  view.octaves = BuildOctaves(disturbed);
  return view;
}

TEST(TrackDirectly, StatesTheNoiseThatItFinds) {
  for (const double sigma_px : {0., 0.3}) {
    Map map = GroundMap();
    const View previous = map.keyframe(1).view;
    EXPECT_FALSE(previous.patch_noise);
    View view = DisturbedView(2, sigma_px);
    view.T_cam_world = previous.T_cam_world;
    const PoseResult result = TrackDirectly(map, previous, view);
    ASSERT_TRUE(view.patch_noise);
    const auto num_found = static_cast<double>(view.features.size());
    EXPECT_GT(result.num_inliers, 0.8 * num_found) << sigma_px;
    if (sigma_px == 0) {
      EXPECT_EQ(view.patch_noise, 1);
    } else {
      EXPECT_GT(view.patch_noise, 1.5);
    }
  }
}

TEST(TrackDirectly, LetsTheNoiseGrowSlowlyFromImageToImage) {
  Map map = GroundMap();
  View previous = map.keyframe(1).view;
  previous.patch_noise = 1;
  View view = DisturbedView(2, 0.3);
  view.T_cam_world = previous.T_cam_world;
  TrackDirectly(map, previous, view);
  EXPECT_DOUBLE_EQ(view.patch_noise.value_or(0), 1.1);
}

TEST(TakeFinalised, TellsTheNoiseOfEachImage) {
  Map map = GroundMap();
  map.keyframe(1).view.patch_noise = 2.2;
  const std::vector<Keyframe> keyframes = TakeFinalised(map, true);
  ASSERT_GE(keyframes.size(), 2U);
  EXPECT_EQ(keyframes[0].patch_noise, 1) << "not measured";
  EXPECT_EQ(keyframes[1].patch_noise, 2.2);
}

TEST(ImageCells, AreAsManyInSmallImages) {
  for (const auto& [width, height] : {std::pair(768, 448), std::pair(384, 224), {480, 270}}) {
    CameraModel camera;
    camera.width = width;
    camera.height = height;
    EXPECT_NEAR(static_cast<double>(ImageCells(camera).size()), 640, 60) << width;
  }
  CameraModel tiny;  // of which a patch is a large part
  tiny.width = 96;
  tiny.height = 64;
  EXPECT_EQ(ImageCells(tiny).size(), 70U);
}

TEST(TrackDirectly, FindsTheNextViewsToAFractionOfAPixel) {
  Map map = GroundMap();
  View previous = map.keyframe(1).view;
  for (int i = 2; i < kNumPatchFrames; ++i) {
    View view = ViewOf(i);
    const Pose truth = view.T_cam_world;
    view.T_cam_world = previous.T_cam_world;  // as if the camera stood still
    const PoseResult result = TrackDirectly(map, previous, view);
    EXPECT_GT(result.num_inliers, 60) << i;
    EXPECT_LT(result.reprojection_px, 0.3) << i;
    ExpectClose(view.T_cam_world, truth);
    ASSERT_EQ(view.points.size(), view.features.size());
    previous = view;
  }
}

TEST(TrackPatches, CountsWhatItTriedAndFound) {
  Map map = GroundMap();
  View view = ViewOf(2);
  const PoseResult result = TrackPatches(map, map.keyframe(1).view, view);
  int num_predicted = 0;
  int num_found = 0;
  for (const MapPoint& point : map.points()) {
    num_predicted += point.num_predicted - 1;
    num_found += point.num_found - 1;
  }
  EXPECT_EQ(num_found, result.num_inliers);
  EXPECT_GE(num_predicted, num_found);
}

TEST(TrackPatches, FindsNothingInTheDark) {
  Map map = GroundMap();
  View view = ViewOf(2);
  view.octaves = BuildOctaves(cv::Mat(224, 384, CV_8UC1, cv::Scalar(0)));
  EXPECT_EQ(TrackPatches(map, map.keyframe(1).view, view).num_inliers, 0);
}

TEST(FindPatch, NeedsAPatchAndImages) {
  Map map = GroundMap();
  const View& view = map.keyframe(1).view;
  const Eigen::Vector2d there = view.features[0].pixel;
  ASSERT_TRUE(map.point(*view.points[0]).patch.has_value());
  EXPECT_TRUE(FindPatch(map, *view.points[0], view, there).has_value());
  View blind = view;
  blind.octaves.clear();
  EXPECT_FALSE(FindPatch(map, *view.points[0], blind, there).has_value());
  map.point(*view.points[0]).patch.reset();
  EXPECT_FALSE(FindPatch(map, *view.points[0], view, there).has_value());
}

// Of the ground at a pixel of a view.
Eigen::Vector2d TrueNormal(const View& view, const Eigen::Vector2d& pixel) {
  const CameraModel& camera = view.frame.camera;
  const Eigen::Vector3d up = view.T_cam_world.rotation() * Eigen::Vector3d::UnitZ();
  return Eigen::Vector2d(up.x() / camera.fx, up.y() / camera.fy) / up.dot(camera.Unproject(pixel));
}

// Root mean square of what the patches of a view lean otherwise than they should: of the tangent.
double LeanError(const Map& map, KeyframeId patch_keyframe) {
  double sum = 0;
  int num = 0;
  for (const MapPoint& point : map.points()) {
    if (!point.patch || point.patch_keyframe != patch_keyframe) continue;
    const View& view = map.keyframe(patch_keyframe).view;
    const Eigen::Vector2d off = point.patch->normal.value - TrueNormal(view, point.patch->pixel);
    sum += off.squaredNorm() * view.frame.camera.fx * view.frame.camera.fx;
    ++num;
  }
  EXPECT_GT(num, 60);
  return std::sqrt(sum / num);
}

// Adds views 2 to the last but one as keyframes that show what FindPatch finds.
void FlyOn(Map& map) {
  for (int i = 2; i < kNumPatchFrames; ++i) {
    View view = ViewOf(i);
    for (const PointId id : map.PointIds()) {
      const Eigen::Vector2d at = map.camera().Project(view.T_cam_world * map.point(id).p_world);
      const auto found = FindPatch(map, id, view, at);
      if (!found) continue;
      view.features.push_back(*found);
      view.points.emplace_back(id);
    }
    EstimatePatchNormals(map, map.AddKeyframe(view));
  }
}

TEST(EstimatePatchNormals, FindsHowTheGroundLies) {
  Map map = GroundMap();
  const double facing = LeanError(map, 0);
  EXPECT_GT(facing, 0.4);  // seen obliquely
  FlyOn(map);
  EXPECT_LT(LeanError(map, 0), 0.4 * facing);
}

TEST(EstimatePatchNormals, StaysWithAPointThatGetsANewPatch) {
  Map map = GroundMap();
  const double facing = LeanError(map, 0);
  FlyOn(map);
  const KeyframeId newest = map.keyframes().size() - 1;
  const View& view = map.keyframe(newest).view;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    TakePatchOf(map, *view.points[i], newest, view.features[i]);
  }
  EXPECT_LT(LeanError(map, newest), 0.4 * facing);
}

TEST(EstimatePatchNormals, LeavesThemAloneWithoutImages) {
  Map map = GroundMap();
  const double before = LeanError(map, 0);
  map.keyframe(1).view.octaves.clear();
  EstimatePatchNormals(map, 1);
  EXPECT_EQ(LeanError(map, 0), before);
}

TEST(CountTrackable, TakesOnePointOfACellSeenByThreeKeyframes) {
  Map map(0, SmallCamera(), FeatureOptions{});
  for (int i = 0; i < 3; ++i) {
    map.AddKeyframe(MakeView(SmallCamera(), {{4, 4}, {8, 8}, {100, 100}, {200, 100}}));
  }
  for (std::size_t feature = 0; feature < 4; ++feature) {
    const PointId point = map.AddPoint({0, 0, 4});
    for (KeyframeId id = 0; id < (feature == 3 ? 2U : 3U); ++id) {
      map.AddObservation(point, {id, feature});
    }
  }
  EXPECT_EQ(CountTrackable(map, map.keyframe(0).view),
            2);  // two of the four share a cell, one is young
}

}  // namespace
}  // namespace mono3d::tracking
