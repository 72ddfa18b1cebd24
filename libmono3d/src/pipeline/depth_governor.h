// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>

#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// How much work a depth map of a live run may take, so that no bundle is dropped, or as few as
// possible: less as soon as bundles wait, and more again when there has been time for it. One
// thread at a time.
class DepthGovernor {
 public:
  // Of the next bundle.
  DepthEffort effort() const { return effort_; }

  // A bundle came.
  void NoteArrival(double now_s);
  // A bundle was worked at for so long, and now so many wait, of `max_waiting` at most.
  void NoteWork(double work_s, std::size_t num_waiting, std::size_t max_waiting);

 private:
  bool MayHaveLess() const;
  bool HasTimeForMore() const;

  DepthEffort effort_ = DepthEffort::kFull;
  double last_arrival_s_ = 0;
  std::size_t num_arrivals_ = 0;
  double interval_s_ = 0;  // from one bundle to the next, smoothed
  double work_s_ = 0;      // of a bundle at this effort, smoothed
  int num_calm_ = 0;       // bundles in a row behind which none waited
};

}  // namespace mono3d
