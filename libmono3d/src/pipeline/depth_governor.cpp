// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/depth_governor.h"

#include <algorithm>
#include <array>
#include <utility>

namespace mono3d {
namespace {

// Depth map and fusion at each effort, in units of one StereoSGBM (MODE_HH, 128 disparities), on
// two cores without a GPU: `mono3d-bench depth` and `fusion`. Only their ratios count.
constexpr std::array<double, 4> kWork = {1.50, 1.43, 1.35, 0.40};
// So many bundles that wait are more than a burst: there is less work, long before one is dropped.
constexpr std::size_t kTooMany = 2;
// Bundles in a row that none waited behind before there is more work again: bundles come in bursts.
constexpr int kCalm = 4;
// Of the time between bundles that the work may take then: what is left holds the next burst.
constexpr double kLoad = 0.8;
// Weight of the newest value in what is smoothed: of the latest four or so.
constexpr double kNewest = 0.4;

// Bundles overlap: a model of every fourth one at full size is as good as one of two thirds of them
// at half the size, and only where fewer can be made the images become smaller.
constexpr double kMaxLoadAtFullSize = 4;

double WorkAt(DepthEffort effort) { return kWork[static_cast<std::size_t>(effort)]; }

DepthEffort Next(DepthEffort effort, int step) {
  return static_cast<DepthEffort>(static_cast<int>(effort) + step);
}

}  // namespace

void DepthGovernor::NoteArrival(double now_s) {
  if (num_arrivals_ > 0) {
    const double interval_s = now_s - last_arrival_s_;
    interval_s_ += (num_arrivals_ == 1 ? 1 : kNewest) * (interval_s - interval_s_);
  }
  last_arrival_s_ = now_s;
  ++num_arrivals_;
}

void DepthGovernor::NoteWork(double work_s, std::size_t num_waiting, std::size_t max_waiting) {
  work_s_ += (work_s_ == 0 ? 1 : kNewest) * (work_s - work_s_);
  num_calm_ = num_waiting == 0 ? num_calm_ + 1 : 0;
  DepthEffort changed = effort_;
  if (num_waiting >= std::clamp<std::size_t>(max_waiting / 2, 1, kTooMany) && MayHaveLess()) {
    changed = Next(effort_, 1);
  } else if (effort_ == DepthEffort::kHalfSize ? HasTimeForMore()
                                               : num_calm_ >= kCalm && HasTimeForMore()) {
    changed = Next(effort_, -1);
  }
  if (changed == effort_) return;
  work_s_ *= WorkAt(changed) / WorkAt(effort_);
  num_calm_ = 0;
  effort_ = changed;
}

bool DepthGovernor::MayHaveLess() const {
  if (effort_ == DepthEffort::kHalfSize) return false;
  return effort_ != DepthEffort::kRefinedOnce || work_s_ > kMaxLoadAtFullSize * interval_s_;
}

bool DepthGovernor::HasTimeForMore() const {
  if (effort_ == DepthEffort::kFull) return false;
  const double more_s = work_s_ * WorkAt(Next(effort_, -1)) / WorkAt(effort_);
  const double max_load = effort_ == DepthEffort::kHalfSize ? kMaxLoadAtFullSize : 1;
  return more_s < kLoad * max_load * interval_s_;
}

}  // namespace mono3d
