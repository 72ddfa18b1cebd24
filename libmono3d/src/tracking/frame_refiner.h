// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "tracking/atlas.h"
#include "tracking/map/map.h"

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
  // Every frame kept, whatever was done before: all of the map while HoldsWholeMap.
  void RefineAll();
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
  struct TrackedFrame {
    std::size_t number = 0;  // in the atlas
    View view;               // features with points, no images
    bool is_final = false;
  };
  using Positions = std::vector<std::size_t>;

  bool IsGlobal() const { return frames_.front().view.frame.sensor.shutter.IsGlobal(); }
  bool IsConsistent() const;
  std::int64_t EndOfFinalPart() const;
  void TakeVelocity(std::size_t position, View& view) const;
  void AdjustFrame(std::size_t position);
  void AdjustFrames(const Positions& positions);

  Atlas* atlas_;
  int min_inliers_;
  std::deque<TrackedFrame> frames_;  // by time; of the final ones the last two, or all of the map
};

}  // namespace mono3d::tracking
