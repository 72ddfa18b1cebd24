// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>

#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

enum class DepthStatus { kEstimated, kRejected };

struct DepthResult {
  DepthStatus status = DepthStatus::kRejected;
  std::string reason;  // why there is no depth: "no baseline between the images"
  DepthMap map;        // empty images when rejected
  int level = 0;       // of the pyramid, the finest that was swept
  // Of the grid through the range on that level. All are swept only where it is the coarsest level;
  // else each pixel is matched on the 16 of them around its prior.
  int num_planes = 0;
  double min_depth_su = 0;  // range of the sweep
  double max_depth_su = 0;  // infinite when the farthest plane is at infinity
};

// Width and height that images need at least.
inline constexpr int kMinDepthSide = 64;

// Depth of the middle image of a bundle, in its keyframe's own unit (paper, section 3.2).
class DepthEstimator {
 public:
  virtual ~DepthEstimator() = default;

  // Throws Error on an invalid bundle, on images smaller than kMinDepthSide or larger than the
  // device's buffers allow (3840x2160 fits any), and with fewer matching images than
  // RefinementOptions::min_views; a bundle without depth in it is a status.
  [[nodiscard]] virtual DepthResult Estimate(const ImageBundle& bundle) = 0;
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
  bool half_pixel = false;  // look the sources of the coarsest level up at half pixels
  // What hides a point from the images before the reference seldom hides it from those after it. A
  // cost is the mean of the two sides, but at most this more than that of the better one. Of
  // unrelated windows of two images a side, half the difference has a standard deviation of 4 (of
  // 62 bits) and 5.7 (of 32, on finer levels): 16 is three times that, more than noise. 0: the
  // better side alone counts, 64: always the mean.
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
  // Of the finest level where it is not the coarsest: 8, or 4 along rows and columns, which are as
  // good around a prior that eight have smoothed.
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
  int min_views = 2;   // matching images that must see a point

  void Visit(OptionVisitor& visit);
};

struct DogOptions {
  // Mean over the census window, grey levels. White noise of one grey level leaves 0.086 and
  // rounding to whole grey levels 0.025, by the norm of the kernel; this is somewhat less than
  // twice both. Where an image has more noise than one grey level it counts so many times.
  double min_response = 0.15;

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

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Plane sweep and semi-global matching on `device`. `times`, where given, must outlive it.
std::unique_ptr<DepthEstimator> CreateDepthEstimator(std::shared_ptr<Device> device,
                                                     const DepthEstimatorOptions& options = {},
                                                     StageTimes* times = nullptr);

}  // namespace mono3d
