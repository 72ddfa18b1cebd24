// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/image_bundle.h"

namespace MONO3D_EXPORT mono3d {

enum class DepthStatus { kEstimated, kRejected };

// Why there is no depth.
enum class DepthRejection {
  kNoBaseline,  // the camera moved too little for the depth of the scene
  kNoOverlap,   // the images do not show the same
  kNoTexture,   // there is nothing to match
  kNoMatch,     // too little of the images matches, for lack of texture or of overlap
  kOther,       // said in words alone
};

struct DepthResult {
  DepthStatus status = DepthStatus::kRejected;
  DepthRejection rejection = DepthRejection::kOther;  // where it is rejected
  std::string reason;  // why there is no depth: "no baseline between the images"
  DepthMap map;        // empty images when rejected
  int level = 0;       // of the pyramid, the finest that was swept
  // Planes that span the range on that level. On the coarsest level all of them are swept; on a
  // finer one each pixel is matched on the 16 around its prior.
  int num_planes = 0;
  double min_depth_su = 0;  // range of the sweep
  double max_depth_su = 0;  // infinite when the farthest plane is at infinity
};

// How much work a depth map may take, beginning with the most. In the order of what a model loses
// least by, of the work it saves: see docs/decisions/0031.
enum class DepthEffort {
  kFull,         // what the options say
  kMatchedOnly,  // nothing is inferred
  kRefinedOnce,  // the same, and one iteration of the refinement
  kHalfSize,     // all of it, of images of half the size
};
const char* ToString(DepthEffort effort);  // "full", "matched only", "refined once", ...

// Width and height that images need at least.
inline constexpr int kMinDepthSide = 64;

// Depth of the reference image of a bundle, in its keyframe's own unit (paper, section 3.2).
class DepthEstimator {
 public:
  virtual ~DepthEstimator() = default;

  // Throws Error on an invalid bundle, and on images smaller than kMinDepthSide or larger than the
  // device's buffers allow (3840x2160 fits any). A bundle without depth in it, or with fewer
  // matching images than RefinementOptions::min_views, is a status.
  [[nodiscard]] virtual DepthResult Estimate(const ImageBundle& bundle) = 0;

  // From the next bundle on: a live run that does not keep up asks for less. With kHalfSize the map
  // is half as wide and high as the images, where these have twice kMinDepthSide. An estimator may
  // leave this out, and works as before.
  virtual void SetEffort(DepthEffort /*effort*/) {}
};

struct PyramidOptions {
  // Halvings of the images on the finest level that is swept; a coarser one is taken when the
  // planes do not fit into the device's buffers.
  int level = 0;
  // Levels from the coarsest, which is swept over the whole range, to the finest; fewer when the
  // image is too small for them. 0: from the image size.
  int num_levels = 0;

  void Visit(OptionVisitor& visit);
};

struct PlaneSweepOptions {
  double min_depth_su = 0;  // 0: from the sparse points, else from a first sweep on a coarse level
  double max_depth_su = 0;
  int max_planes = 256;
  // A point hidden from the images before the reference is usually visible in those after it. The
  // cost of a plane is the mean of the costs of the two sides, but at most this much more than that
  // of the better side. Half the difference of two unrelated costs has a standard deviation of 4
  // (62 bits) or 5.7 (32 bits, finer levels): 16 is three times that. 0: the better side alone
  // counts; 64: always the mean.
  int side_tolerance = 16;

  void Visit(OptionVisitor& visit);
};

// Penalties in units of half a census bit: matching costs are 0 to 124.
struct SgmOptions {
  int p1 = 10;                 // for a step of one plane
  int p2 = 100;                // for a larger jump between pixels of the same grey value
  int min_p2 = 20;             // across the strongest edges
  int gradient = 8;            // grey levels of difference that halve P2
  bool follow_normals = true;  // SGM^sn below the coarsest level
  // Paths on the finest level where it is not the coarsest: 8, or the 4 along rows and columns,
  // which are as good around a prior that eight paths have smoothed.
  int finest_paths = 4;

  void Visit(OptionVisitor& visit);
};

struct WinnerTakesAllOptions {
  // Largest cost of the winning plane, 0 to 124. Unrelated windows differ in half their bits, 62,
  // with a standard deviation of 5.6 for two of them; the best of 16 planes and two sides is 50 by
  // chance, and seldom below 46.
  int max_cost = 46;
  double min_uniqueness = 0.06;  // share by which any plane not next to it must be worse
  bool sub_plane = true;  // between the planes, by the parabola through the costs; else on them

  void Visit(OptionVisitor& visit);
};

struct MedianOptions {
  int min_support = 13;  // of the 25 pixels, how many must agree with their median; 0: no median

  void Visit(OptionVisitor& visit);
};

// Refinement of the swept depth on the grey values of all images, at full resolution.
struct RefinementOptions {
  int iterations = 2;  // 0: none
  // Matching images that must see a point. What one alone sees is not confirmed by another; as of
  // all points, its depth goes where another pixel contradicts it in every image that sees it.
  int min_views = 1;

  void Visit(OptionVisitor& visit);
};

struct DogOptions {
  // Least mean response over the census window of a pixel with depth, grey levels. By the norm of
  // the kernel, white noise of one grey level has a response of 0.086 and rounding to whole grey
  // levels one of 0.025; this is somewhat less than twice the two together. In images with more
  // noise it is multiplied by that noise in grey levels, up to five.
  double min_response = 0.15;

  void Visit(OptionVisitor& visit);
};

// Of pixels that were not matched: too little texture, no plane clearly better than the others, or
// surfaces so rough that no two images show the same of them.
struct InferenceOptions {
  // Their depth is that of the smooth surface through the matched pixels around them, where it is
  // near the best match of the pixel, or near that of a coarser level of the pyramid, and
  // DepthMap::inferred. Off: they have no depth.
  bool enabled = true;
  // In planes, which are a pixel of motion in the farthest camera. On indoor video (depth by a
  // time-of-flight sensor) 85 % of what differs by a plane at most is right to 10 %, 71 % of what
  // differs by two to four and 55 % of what differs by more.
  double max_difference = 3;

  void Visit(OptionVisitor& visit);
};

struct DepthEstimatorOptions {
  PyramidOptions pyramid;
  PlaneSweepOptions plane_sweep;
  SgmOptions sgm;
  WinnerTakesAllOptions winner_takes_all;
  MedianOptions median;
  RefinementOptions refinement;
  DogOptions dog;
  InferenceOptions inference;
  // CV_8UC1 of the size of the images, not 0 where none of them shows the scene
  // (FrameSource::hidden): there is no depth there. Empty: none. Not among the listed options.
  cv::Mat hidden = {};

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The options of an estimator that works with less effort.
DepthEstimatorOptions WithEffort(const DepthEstimatorOptions& options, DepthEffort effort);

// Plane sweep and semi-global matching on `device`. `times`, where given, must outlive it.
std::unique_ptr<DepthEstimator> CreateDepthEstimator(std::shared_ptr<Device> device,
                                                     const DepthEstimatorOptions& options = {},
                                                     StageTimes* times = nullptr);

}  // namespace mono3d
