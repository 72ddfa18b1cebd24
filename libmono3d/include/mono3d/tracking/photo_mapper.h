// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/image/frame.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

// How far the placing of photographs is.
struct PhotoMapperProgress {
  enum class Step { kFeatures, kMatching, kPlacing };
  Step step = Step::kFeatures;
  std::int64_t done = 0;   // photos that were looked at, pairs that were matched, photos placed
  std::int64_t total = 0;  // 0: not known
};

struct PhotoMapperOptions {
  int num_features = 2500;  // SIFT features per photo, twice as many where these are too few
  // Larger photos are matched on smaller ones with a longer side of so many pixels.
  int max_side_px = 1600;
  // Up to so many photos each is matched with each; of more, each with those that look most alike.
  int max_exhaustive = 60;
  int num_partners = 24;          // of each photo, where not all are matched
  int min_matches = 20;           // of a pair of photos that the epipolar geometry agrees with
  int min_inliers = 20;           // scene points that the pose of a photo must rest on
  double min_parallax_deg = 1.5;  // of a scene point, between two of the photos that show it
  int max_starts = 6;             // pairs of photos that are tried as the start of a map
  int seed = 1;                   // of RANSAC
  // The photos are frames of one video, if far apart: their times tell how each of them moved,
  // which a rolling shutter is followed by, and learned by. Else shutters count as global. Not
  // among the listed options.
  bool are_frames = false;
  // Called now and then by any thread, one call at a time, from within Finish, or from within the
  // calibration where a camera is learned of photos. Must not throw. Not listed either.
  std::function<void(const PhotoMapperProgress&)> on_progress;
  // Once true, what takes long comes to its end: no more pairs are matched and no more photos
  // placed; in a pipeline no more depth maps are made of them. What is placed is the result.
  const std::atomic<bool>* stop = nullptr;

  bool IsStopped() const { return stop != nullptr && *stop; }
  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Photographs of one scene in any order, none of them near the one before: SIFT features, matched
// with all other photos or with those that look alike, checked by the epipolar geometry; a start
// from two of them, every further one by the scene points that it shows (P3P within RANSAC), and
// bundle adjustment over all; photos that end with too few points are placed again or taken out.
// Parts that have nothing in common become maps of their own, of three photos or more. Where
// more than one in fifty is outside the largest, they are looked at once more with twice as many
// features each, and the result that holds more photos counts.
//
// Track only looks at the photo; Finish places them all (TrackingResult::is_pending), and hands out
// every one that has a pose as a keyframe. The result depends neither on the order of the photos,
// nor on their names and, but for `are_frames`, times. Keeps the images of all photos until then.
// Constraints are ignored. `times`, where given, must outlive it.
std::unique_ptr<Tracker> CreatePhotoMapper(const PhotoMapperOptions& options = {},
                                           StageTimes* times = nullptr);

// One of some images in groups, as the images of several maps.
struct GroupedImage {
  std::size_t group = 0;
  std::function<std::optional<Frame>()> open;  // called once; nothing: it cannot be read
};

// Do two images of different groups show the same? Features are matched as CreatePhotoMapper does
// it, every image with each of another group: the time grows with the square of their number. False
// when stopped.
bool ShowTheSame(std::span<const GroupedImage> images, const PhotoMapperOptions& options = {});

// How much of one picture the next one shows again: the share of its features that are found there,
// over the share that is found in the picture itself, turned and resized a little; 0 to 1, and 1
// where it has moved by less than 3 % of the longer side. Neighbouring frames of a video have 0.8
// and more in common, photographs 10 degrees apart 0.6, those of another order of a walk 0.2.
// Nothing of pictures that show too little. CV_8UC3.
std::optional<double> ContinuityOf(const cv::Mat& bgr, const cv::Mat& next_bgr);

}  // namespace mono3d
