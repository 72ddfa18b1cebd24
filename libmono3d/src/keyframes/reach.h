// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace mono3d {

// How wide the steps of a bundle are to be, learnt from what depth maps of wide and of narrow ones
// were worth. As wide as allowed at first: the depth error falls with the baseline, until the
// images differ too much to be matched. Then maps have more holes than surface; after two of these
// in a row the next width is tried, and of those heard of lately that with the most confident
// surface stays. What was heard long ago counts no more, and a wider one is tried again.
class Reach {
 public:
  explicit Reach(double max_ratio) : max_ratio_(max_ratio) {}

  // Baseline between neighbouring images over the median depth, at most.
  double ratio() const { return max_ratio_ * kShares.at(current_); }

  // Which of the widths that is, the widest first.
  std::size_t width() const { return current_; }

  // Of a bundle that was chosen for that width: the share of its pixels with an estimate, and the
  // mean confidence over all pixels.
  void ReportDepthQuality(std::size_t width, double density, double worth);

 private:
  // Each doubles what a pixel of matching error makes of the depth in two steps.
  static constexpr std::array<double, 3> kShares = {1, 0.7071, 0.5};

  // What maps of one width were worth.
  struct Heard {
    double worth = 0;         // recursive mean
    int count = 0;            // of maps, up to kMaxCount
    std::int64_t latest = 0;  // the number of the last of them
  };

  bool IsFresh(std::size_t width) const;
  std::size_t Best() const;

  double max_ratio_;
  std::size_t current_ = 0;
  int num_poor_ = 0;  // of the current width, in a row
  std::int64_t num_heard_ = 0;
  std::array<std::optional<Heard>, kShares.size()> heard_;
};

}  // namespace mono3d
