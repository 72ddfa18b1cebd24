// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/depth/depth_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <span>
#include <utility>
#include <vector>

#include "depth/buffers.h"
#include "depth/bundle_checks.h"
#include "depth/coarse_matches.h"
#include "depth/contradictions.h"
#include "depth/grey_images.h"
#include "depth/hierarchy.h"
#include "depth/inference.h"
#include "depth/inference_tiles.h"
#include "depth/kernels.h"
#include "depth/map_storage.h"
#include "depth/min_response.h"
#include "depth/planar_regions.h"
#include "depth/refiner.h"
#include "depth/side_agreement.h"
#include "depth/single_views.h"
#include "depth/sky.h"
#include "depth/sweep_geometry.h"
#include "depth/sweep_plan.h"
#include "gpu/recorder.h"
#include "image/image_noise.h"

namespace mono3d {
namespace {

// Half the width of the 9x7 census window, which the image border cuts nearer than this.
constexpr int kUncertainBorder_px = 4;

// If the nearest and the farthest depth project to places less than this apart in every image, the
// sweep measures nothing but noise.
constexpr double kMinMotionPx = 2;
// Images overlap when a source sees at least this share of the reference, in the middle of the
// range of inverse depths or at its far end.
constexpr double kMinVisibleShare = 0.1;
// A bundle that does not match keeps a few chance estimates: fewer than this share of the pixels.
constexpr double kMinDensity = 0.01;

// Planes by which the depths of two pixels must differ to contradict each other: one plane each for
// what refinement may have left.
constexpr float kContradiction = 2;
// What no second image confirms is as often wrong as what has half its confidence and is confirmed
// (decision 45).
constexpr double kSingleConfidence = 0.5;
// Above this what is missing are the edges of surfaces, and inferring them is not worth the time.
constexpr double kWholeDensity = 0.98;
// Matching images that must see an inferred point, which no match of its own proves.
constexpr int kMinViewsToInfer = 2;
// Pixels of the census window, 9x7, over which the texture is averaged.
constexpr double kTextureWindow = 63;
// dog.comp counts in 1/256 grey level.
constexpr double kDogUnitsPerGrey = 256;

DepthResult Rejected(DepthRejection rejection, std::string reason) {
  DepthResult result;
  result.rejection = rejection;
  result.reason = std::move(reason);
  return result;
}

// With the reason that the images themselves show, such as no texture, where there is one.
DepthResult NotMatched(const ImageBundle& bundle, std::string reason) {
  if (std::optional<std::string> no_texture = ReasonInTheImages(bundle)) {
    return Rejected(DepthRejection::kNoTexture, *std::move(no_texture));
  }
  return Rejected(DepthRejection::kNoMatch, std::move(reason));
}

// Without the border of the content in which census windows reach beyond it; that of the image is
// the map's uncertain border.
cv::Rect ShownSurely(const Frame& frame) {
  const cv::Rect& content = frame.content;
  const cv::Point end = content.br();
  const cv::Point from(content.x == 0 ? 0 : content.x + kUncertainBorder_px,
                       content.y == 0 ? 0 : content.y + kUncertainBorder_px);
  const cv::Point to(end.x == frame.camera.width ? end.x : end.x - kUncertainBorder_px,
                     end.y == frame.camera.height ? end.y : end.y - kUncertainBorder_px);
  return to.x <= from.x || to.y <= from.y ? cv::Rect() : cv::Rect(from, to);
}

void ClearWhere(const cv::Mat& mask, DepthMap& map) {
  for (const cv::Mat& values : {map.depth, map.normal, map.confidence, map.inferred}) {
    cv::Mat cleared = values;
    if (!cleared.empty()) cleared.setTo(cv::Scalar::all(0), mask);
  }
}

void ClearAround(const cv::Rect& shown, DepthMap& map) {
  cv::Mat around(map.depth.size(), CV_8UC1, cv::Scalar(255));
  around(shown).setTo(0);
  ClearWhere(around, map);
}

// `hidden`: of images of any size.
void ClearHidden(const cv::Mat& hidden, DepthMap& map) {
  cv::Mat at_size = hidden != 0;
  if (at_size.size() != map.depth.size()) {
    cv::resize(at_size, at_size, map.depth.size(), 0, 0, cv::INTER_AREA);
  }
  ClearWhere(at_size, map);
}

// Of all pixels, row by row; confidence 0: nothing is inferred, below 0: it was matched on a
// coarser level.
struct InferredValues {
  std::span<const float> inverse_depth;
  std::span<const float> confidence;
  std::span<const float> normal;  // three each
};

void AddInferred(const cv::Rect& pixels, const InferredValues& inferred, DepthMap& map) {
  for (int y = pixels.y; y < pixels.br().y; ++y) {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(map.depth.cols);
    for (int x = pixels.x; x < pixels.br().x; ++x) {
      const std::size_t i = row + static_cast<std::size_t>(x);
      const float confidence = inferred.confidence[i];
      if (confidence == 0) continue;
      const float* const normal = &inferred.normal[3 * i];
      map.inferred.at<std::uint8_t>(y, x) = confidence > 0 ? kInferred : kCoarselyMatched;
      map.depth.at<float>(y, x) = 1 / inferred.inverse_depth[i];
      map.confidence.at<float>(y, x) = std::abs(confidence);
      map.normal.at<cv::Vec3f>(y, x) = {normal[0], normal[1], normal[2]};
    }
  }
}

class VulkanDepthEstimator final : public DepthEstimator {
 public:
  VulkanDepthEstimator(std::shared_ptr<Device> device, const DepthEstimatorOptions& options,
                       StageTimes* times);

  DepthResult Estimate(const ImageBundle& bundle) override;
  void SetEffort(DepthEffort effort) override;

 private:
  DepthResult EstimateAtSize(const ImageBundle& bundle);
  void RecordRefinement(const SweepGeometry& geometry, const SweepPlan& plan);
  NormalsParams ParamsOfNormals(const SweepGeometry& geometry, const SweepPlan& plan) const;
  DepthMap DownloadMap(const ImageBundle& bundle, double largest_baseline_su);
  EstimateBuffers Refined(const SweepPlan& plan) const;
  EstimateBuffers RefinedWithout(const cv::Mat& doubtful, const SweepPlan& plan);
  cv::Mat ClearDoubtful(const SweepGeometry& geometry, const SweepPlan& plan, DepthMap& map) const;
  void AddCoarseMatches(const cv::Mat& depth, cv::Mat& cells);
  void Infer(const SweepGeometry& geometry, const SweepPlan& plan, const cv::Mat& doubtful,
             DepthMap& map);

  std::shared_ptr<Device> device_;
  DepthEstimatorOptions given_;    // with full effort
  DepthEstimatorOptions options_;  // with that of the moment
  bool is_half_size_ = false;
  StageTimes* times_;
  Recorder recorder_;
  DepthKernels kernels_;
  Hierarchy hierarchy_;
  Refiner refiner_;
  Inference inference_;
  Buffer upsampled_depth_;  // these at full resolution
  Buffer upsampled_confidence_;
  Buffer normals_;
  ImageNoise noise_;  // of the reference
  Buffer response_;
  Buffer filtered_depth_;
  Buffer certain_depth_;
  Buffer filtered_confidence_;
  MapStorage storage_;
  // Kept, like the buffers; where the host cannot see these.
  std::vector<float> unfiltered_;
  std::vector<float> certain_;
  std::vector<float> winners_;
  std::vector<std::vector<float>> coarse_;
  std::vector<std::int32_t> responses_;
  std::vector<float> inferred_inverse_depth_;
  std::vector<float> inferred_confidence_;
  std::vector<float> inferred_normal_;
};

VulkanDepthEstimator::VulkanDepthEstimator(std::shared_ptr<Device> device,
                                           const DepthEstimatorOptions& options, StageTimes* times)
    : device_(std::move(device)),
      given_(options),
      options_(options),
      times_(times),
      recorder_(device_),
      kernels_(device_),
      hierarchy_(device_, kernels_, options),
      refiner_(device_, kernels_, options.refinement),
      inference_(device_, kernels_, options.inference) {
  kernels_.Prepare(options);
}

void VulkanDepthEstimator::SetEffort(DepthEffort effort) {
  options_ = WithEffort(given_, effort);
  is_half_size_ = effort == DepthEffort::kHalfSize;
  refiner_.SetIterations(options_.refinement.iterations);
}

DepthResult VulkanDepthEstimator::Estimate(const ImageBundle& bundle) {
  RequireBundle(bundle, *device_);
  const CameraModel& camera = bundle.reference().frame.camera;
  const bool can_halve = std::min(camera.width, camera.height) >= 2 * kMinDepthSide;
  return EstimateAtSize(is_half_size_ && can_halve ? HalfSize(bundle) : bundle);
}

DepthResult VulkanDepthEstimator::EstimateAtSize(const ImageBundle& bundle) {
  if (!HasEnoughViews(bundle, options_.refinement)) {
    return Rejected(DepthRejection::kOther, "fewer matching images than refinement.min_views");
  }
  const ScopedStageTimer timer(times_, "depth/estimate");
  const SweepGeometry geometry(bundle);
  if (!geometry.HasBaseline()) {
    return Rejected(DepthRejection::kNoBaseline, "no baseline between the images");
  }
  const GreyImages greys = GreyImagesOf(bundle);
  hierarchy_.Upload(bundle, greys);
  const Frame& reference = bundle.reference().frame;
  // A copy: filters would look beyond the borders of a part.
  noise_ = MeasureNoise(reference.content.empty() ? greys.reference
                                                  : greys.reference(reference.content).clone());
  const std::optional<InverseDepthRange> range =
      hierarchy_.FindRange(recorder_, bundle, geometry, times_);
  if (!range) return NotMatched(bundle, "the images do not overlap or do not match");
  if (std::max(geometry.VisibleShare(range->farthest),
               geometry.VisibleShare(0.5 * (range->farthest + range->nearest))) <
      kMinVisibleShare) {
    return Rejected(DepthRejection::kNoOverlap, "the images do not overlap");
  }
  const double motion_px =
      (range->nearest - range->farthest) * geometry.PixelsPerInverseDepth(*range);
  if (motion_px < kMinMotionPx) {
    return Rejected(DepthRejection::kNoBaseline, "the baseline is too small for the depth");
  }

  const SweepPlan plan = hierarchy_.Record(recorder_, geometry, *range);
  RecordRefinement(geometry, plan);
  recorder_.Submit(times_);

  DepthMap map = DownloadMap(bundle, geometry.largest_baseline_su());
  const auto density = [&] {
    return static_cast<double>(CountEstimates(map)) /
           static_cast<double>(reference.ContentOrAll().area());
  };
  const std::optional<SideDifferences> sides = MeasureSides(greys, geometry, map.depth, map.normal);
  const bool are_unrelated = density() >= kMinDensity && sides && AreUnrelated(*sides);
  const cv::Mat doubtful = ClearDoubtful(geometry, plan, map);
  const double certain_density = density();
  DepthResult result;
  if (are_unrelated) {
    result = Rejected(DepthRejection::kNoMatch,
                      "the images do not match: those before and after the middle one disagree");
  } else if (certain_density < kMinDensity) {
    result = NotMatched(bundle, "too little texture, or the images do not match");
  } else {
    result.status = DepthStatus::kEstimated;
  }
  result.level = plan.level;
  result.num_planes = static_cast<int>(plan.num_planes);
  result.min_depth_su = 1 / (plan.inverse_depth + plan.step * (plan.num_planes - 1));
  result.max_depth_su =
      plan.inverse_depth > 0 ? 1 / plan.inverse_depth : std::numeric_limits<double>::infinity();
  if (result.status != DepthStatus::kEstimated) return result;
  if (options_.inference.enabled && certain_density < kWholeDensity) {
    Infer(geometry, plan, doubtful, map);
  }
  if (!reference.content.empty()) ClearAround(ShownSurely(reference), map);
  if (!options_.hidden.empty()) ClearHidden(options_.hidden, map);
  result.map = std::move(map);
  return result;
}

// Before the texture filter.
EstimateBuffers VulkanDepthEstimator::Refined(const SweepPlan& plan) const {
  if (options_.refinement.iterations > 0) return {refiner_.inverse_depth(), refiner_.confidence()};
  if (plan.level > 0) return {upsampled_depth_, upsampled_confidence_};
  return {hierarchy_.inverse_depth(), hierarchy_.confidence()};
}

// At full resolution.
NormalsParams VulkanDepthEstimator::ParamsOfNormals(const SweepGeometry& geometry,
                                                    const SweepPlan& plan) const {
  const CameraModel& camera = geometry.camera();
  const LevelSize size = SizeAtLevel(camera, 0);
  return {.width_px = size.width_px,
          .height_px = size.height_px,
          .fx = static_cast<float>(camera.fx),
          .fy = static_cast<float>(camera.fy),
          .cx = static_cast<float>(camera.cx),
          .cy = static_cast<float>(camera.cy),
          .tolerance = static_cast<float>(plan.step / (1u << static_cast<unsigned>(plan.level)))};
}

// Takes out of the map what FindContradicted and FindSingleViews doubt, and returns it: not 0.
// Empty: nothing.
cv::Mat VulkanDepthEstimator::ClearDoubtful(const SweepGeometry& geometry, const SweepPlan& plan,
                                            DepthMap& map) const {
  const ScopedStageTimer timer(times_, "depth/doubtful");
  const auto clear = [&map](const cv::Mat& pixels) {
    for (const cv::Mat& values : {map.depth, map.normal, map.confidence}) {
      cv::Mat cleared = values;
      cleared.setTo(cv::Scalar::all(0), pixels);
    }
  };
  const float tolerance = kContradiction * ParamsOfNormals(geometry, plan).tolerance;
  const cv::Mat contradicted = FindContradicted(geometry, map.depth, map.confidence, tolerance);
  clear(contradicted);
  const cv::Mat views = FindSingleViews(geometry, map.depth);
  const cv::Mat single = views == kDoubtfulSingle;
  clear(single);
  cv::Mat halved = kSingleConfidence * map.confidence;
  halved.copyTo(map.confidence, views == kSingle);
  const cv::Mat both = contradicted | single;
  return cv::countNonZero(both) > 0 ? both : cv::Mat();
}

// What Refined has, without these pixels.
EstimateBuffers VulkanDepthEstimator::RefinedWithout(const cv::Mat& doubtful,
                                                     const SweepPlan& plan) {
  const EstimateBuffers refined = Refined(plan);
  if (doubtful.empty()) return refined;
  Reserve(certain_depth_, device_, sizeof(float) * doubtful.total(), "depth/certain");
  const std::span<const float> before = refined.inverse_depth.Read(unfiltered_);
  const std::span<float> certain = certain_depth_.BeginWrite(certain_);
  const auto* const is_doubtful = doubtful.ptr<std::uint8_t>();
  for (std::size_t i = 0; i < doubtful.total(); ++i) {
    certain[i] = is_doubtful[i] != 0 ? 0.0F : before[i];
  }
  certain_depth_.EndWrite(certain_);
  return {certain_depth_, refined.confidence};
}

// Cells without a plane that were matched on a coarser level alone (inference.glsl).
void VulkanDepthEstimator::AddCoarseMatches(const cv::Mat& depth, cv::Mat& cells) {
  const auto results = hierarchy_.results();
  coarse_.resize(3 * results.size());
  std::size_t num_read = 0;
  const auto map_of = [&](const Buffer& buffer, const LevelSize& size) {
    const std::span<const float> values = buffer.Read(coarse_[num_read++]);
    return cv::Mat(static_cast<int>(size.height_px), static_cast<int>(size.width_px), CV_32FC1,
                   const_cast<float*>(values.data()));
  };
  std::vector<CoarseMatches> levels;
  for (std::size_t i = results.size() - 1; i-- > 0;) {
    const auto& [plan, selection] = results[i];
    levels.push_back({.level = plan.level,
                      .step = plan.step,
                      .winners = map_of(selection->winners().inverse_depth, plan.size),
                      .uniqueness = map_of(selection->winners().confidence, plan.size),
                      .inverse_depth = map_of(selection->inverse_depth(), plan.size)});
  }
  if (levels.empty()) return;
  const int stride = 4 * ((depth.cols + 3) / 4);
  const std::span<const std::int32_t> responses = response_.Read(responses_);
  const cv::Mat response(depth.rows, stride, CV_32SC1, const_cast<std::int32_t*>(responses.data()));
  const cv::Mat coarse = FindCoarseMatches(
      {.levels = levels,
       .depth = depth,
       .response = response.colRange(0, depth.cols),
       .min_response = MinResponse(options_.dog, noise_) * kDogUnitsPerGrey,
       .min_uniqueness = static_cast<float>(options_.winner_takes_all.min_uniqueness),
       .min_support = options_.median.min_support});
  cells.forEach<cv::Vec4f>([&coarse](cv::Vec4f& cell, const int* at) {
    if (cell[3] != 0) return;
    const cv::Vec3f& matched = coarse.at<cv::Vec3f>(at);
    cell = {matched[0], matched[1], matched[2], 0};
  });
}

// Adds what is inferred to the map of what was matched, which stays as it is.
void VulkanDepthEstimator::Infer(const SweepGeometry& geometry, const SweepPlan& plan,
                                 const cv::Mat& doubtful, DepthMap& map) {
  const std::vector<std::uint32_t> tiles = TilesWithoutDepth(map.depth);
  if (tiles.empty()) return;
  if (!doubtful.empty()) {
    filtered_depth_.Upload(std::span<const float>(map.depth.ptr<float>(), map.depth.total()));
  }
  const EstimateBuffers refined = RefinedWithout(doubtful, plan);
  const std::span<const float> before_filter = refined.inverse_depth.Read(unfiltered_);
  const cv::Mat unfiltered(map.depth.size(), CV_32FC1, const_cast<float*>(before_filter.data()));
  const cv::Mat winners(static_cast<int>(plan.size.height_px), static_cast<int>(plan.size.width_px),
                        CV_32FC1, const_cast<float*>(hierarchy_.winners().Read(winners_).data()));
  cv::Mat cells =
      FindPlanarRegions({.bgr = map.bgr,
                         .depth = map.depth,
                         .unfiltered = unfiltered,
                         .winners = winners,
                         .winner_level = plan.level,
                         .sky = FindSky(map.bgr, map.depth),
                         .step = plan.step,
                         .max_difference = static_cast<int>(options_.inference.max_difference)});
  AddCoarseMatches(map.depth, cells);
  inference_.Record(recorder_,
                    {.size = SizeAtLevel(map.camera, 0),
                     .images = hierarchy_.images(0),
                     .halved = hierarchy_.images(1),
                     .matched = refined,
                     .depth = filtered_depth_,
                     .winners = hierarchy_.winners(),
                     .winner_size = plan.size,
                     .winner_level = plan.level,
                     .step = plan.step,
                     .projections = geometry.Projections(0),
                     .min_views = std::max(options_.refinement.min_views, kMinViewsToInfer),
                     .min_coarse_views = options_.refinement.min_views,
                     .cells = cells,
                     .tiles = tiles,
                     .normals = ParamsOfNormals(geometry, plan)});
  recorder_.Submit(times_);
  const InferredValues inferred{inference_.inverse_depth().Read(inferred_inverse_depth_),
                                inference_.confidence().Read(inferred_confidence_),
                                inference_.normals().Read(inferred_normal_)};
  map.inferred = storage_.Take(map.depth.size(), CV_8UC1);
  map.inferred.setTo(0);
  for (const std::uint32_t tile : tiles) {
    AddInferred(PixelsOfTile(tile, map.depth.size()), inferred, map);
  }
  // What was matched on a coarser level may be seen by one source.
  const cv::Mat views = FindSingleViews(geometry, map.depth);
  ClearWhere(map.inferred & (views == kDoubtfulSingle), map);
}

void VulkanDepthEstimator::RecordRefinement(const SweepGeometry& geometry, const SweepPlan& plan) {
  const CameraModel& camera = geometry.camera();
  const LevelSize size = SizeAtLevel(camera, 0);
  const std::size_t map_bytes = sizeof(float) * size.num_pixels();
  Reserve(normals_, device_, 3 * map_bytes, "depth/normals");
  Reserve(response_, device_, 4 * size.num_strided_pixels(), "depth/dog");
  Reserve(filtered_depth_, device_, map_bytes, "depth/texture_filter");
  Reserve(filtered_confidence_, device_, map_bytes, "depth/filtered_confidence");
  const Buffer* inverse_depth = &hierarchy_.inverse_depth();
  const Buffer* confidence = &hierarchy_.confidence();
  const std::uint32_t factor = 1u << static_cast<unsigned>(plan.level);
  if (plan.level > 0) {
    Reserve(upsampled_depth_, device_, map_bytes, "depth/upsample");
    Reserve(upsampled_confidence_, device_, map_bytes, "depth/upsampled_confidence");
    // Neighbours on one surface differ by at most a plane each way.
    kernels_.Upsample(recorder_,
                      {.coarse_width_px = plan.size.width_px,
                       .coarse_height_px = plan.size.height_px,
                       .width_px = size.width_px,
                       .height_px = size.height_px,
                       .factor = factor,
                       .tolerance = static_cast<float>(2 * plan.step)},
                      {*inverse_depth, *confidence}, {upsampled_depth_, upsampled_confidence_});
    inverse_depth = &upsampled_depth_;
    confidence = &upsampled_confidence_;
  }
  if (options_.refinement.iterations > 0) {
    refiner_.Record(recorder_, geometry,
                    {.images = hierarchy_.images(0),
                     .quarter = hierarchy_.images(Hierarchy::kDetailLevel),
                     .gains = hierarchy_.contrast_gains(),
                     .inverse_depth = *inverse_depth,
                     .uniqueness = *confidence,
                     .step = plan.step / factor,
                     .noise = noise_.typical});
    inverse_depth = &refiner_.inverse_depth();
    confidence = &refiner_.confidence();
  }
  kernels_.Normals(recorder_, ParamsOfNormals(geometry, plan), *inverse_depth, normals_);
  kernels_.Dog(recorder_, hierarchy_.images(0), size, response_);
  const double min_sum = MinResponse(options_.dog, noise_) * kDogUnitsPerGrey * kTextureWindow;
  kernels_.TextureFilter(recorder_,
                         {.width_px = size.width_px,
                          .height_px = size.height_px,
                          .min_response_sum = static_cast<std::uint32_t>(min_sum)},
                         response_, {*inverse_depth, *confidence}, filtered_depth_,
                         filtered_confidence_);
}

DepthMap VulkanDepthEstimator::DownloadMap(const ImageBundle& bundle, double largest_baseline_su) {
  const Keyframe& reference = bundle.reference();
  const CameraModel& camera = reference.frame.camera;
  DepthMap map;
  const cv::Size size(camera.width, camera.height);
  map.depth = storage_.Take(size, CV_32FC1);
  map.normal = storage_.Take(size, CV_32FC3);
  map.confidence = storage_.Take(size, CV_32FC1);
  filtered_depth_.Download(std::span<float>(map.depth.ptr<float>(), map.depth.total()));
  normals_.Download(std::span<float>(map.normal.ptr<float>(), 3 * map.normal.total()));
  filtered_confidence_.Download(
      std::span<float>(map.confidence.ptr<float>(), map.confidence.total()));
  map.normal.setTo(cv::Scalar::all(0), map.depth == 0);
  map.bgr = reference.frame.bgr;
  map.camera = camera;
  map.keyframe_id = reference.id;
  map.frame_index = reference.frame.index;
  map.timestamp_s = reference.frame.timestamp_s;
  map.depth_sigma_per_square_depth = 1 / (camera.fx * largest_baseline_su);
  double sum_of_noise = 0;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    const Keyframe& keyframe = bundle.keyframes[i];
    sum_of_noise += keyframe.patch_noise;
    if (i != bundle.reference_index()) map.views.push_back({keyframe.id, bundle.T_ref_cam[i]});
  }
  map.patch_noise = sum_of_noise / static_cast<double>(bundle.keyframes.size());
  map.uncertain_border_px = kUncertainBorder_px;
  return map;
}

}  // namespace

std::unique_ptr<DepthEstimator> CreateDepthEstimator(std::shared_ptr<Device> device,
                                                     const DepthEstimatorOptions& options,
                                                     StageTimes* times) {
  options.Validate();
  return std::make_unique<VulkanDepthEstimator>(std::move(device), options, times);
}

}  // namespace mono3d
