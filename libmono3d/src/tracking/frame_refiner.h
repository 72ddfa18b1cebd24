// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "tracking/atlas.h"
#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// Makes the poses of tracked frames better once the map around them has settled. A frame is tracked
// in the map of that moment, and newer keyframes still move what it shows. So that is kept until
// the keyframes on both sides are final; then the frame is adjusted to the map as it is. With a
// rolling shutter, velocities are taken from the poses of the frames around, those of keyframes as
// well, for their next adjustment. All frames are of the map in use.
class FrameRefiner {
 public:
  // The atlas must outlive it.
  FrameRefiner(Atlas* atlas, int min_inliers) : atlas_(atlas), min_inliers_(min_inliers) {}

  // A frame that was added to the atlas under this number, in any order of time.
  void Add(std::size_t number, const View& view);
  // Those of this number and later were removed from the atlas.
  void ForgetFrom(std::size_t number);
  // Of the frames that are not final, the views that are no keyframes, from a frame index on.
  std::vector<View> ViewsFrom(std::int64_t frame_index) const;
  // Their map has gone into another one.
  void Renumber(const NumberShift& shift);
  // Adjusts the frames between final keyframes, each once; with a rolling shutter also those that
  // are not final yet, each time.
  void Refine();
  // Every frame kept, whatever was done before: all of the map while HoldsWholeMap. Between two
  // frames tracking may come in, and add frames.
  void RefineAll(MappingLock& lock);
  // The frames of all keyframes are kept, and those between: all velocities can be taken anew. With
  // a rolling shutter, until the map is large; never of a map that was loaded.
  bool HoldsWholeMap() const;
  // The map is left, or no more frames come: adjusts those that are not final, of a map that is
  // held whole all, and forgets them.
  void Finish();
  // Of a tracker with this camera, for the archives of image/state_archive.h; after the atlas.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  // Where a frame shows a point of the map.
  struct Sighting {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double sigma_px = 1;
    PointId point;
  };
  // A third of the memory of its view.
  struct TrackedFrame {
    std::size_t number = 0;  // in the atlas
    Frame frame;             // without its image
    std::vector<Sighting> sightings;
    bool is_final = false;
  };
  using FrameIndices = std::vector<std::int64_t>;

  bool IsGlobal() const { return frames_.front().frame.sensor.shutter.IsGlobal(); }
  // With its pose and the features that show points, and nothing else.
  View ViewOf(const TrackedFrame& frame) const;
  bool IsConsistent() const;
  std::int64_t EndOfFinalPart() const;
  VelocityPrior VelocityAt(std::size_t position) const;
  void AdjustFrame(std::size_t position);
  void AdjustFrames(const FrameIndices& frames, MappingLock& lock);

  Atlas* atlas_;
  int min_inliers_;
  std::deque<TrackedFrame> frames_;  // by time; of the final ones the last two, or all of the map
};

}  // namespace mono3d::tracking
