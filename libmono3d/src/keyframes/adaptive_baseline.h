// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace mono3d {

// The largest baseline between neighbouring images of a bundle, adapted to the quality of the depth
// maps so far. It begins at the largest allowed value: the depth error falls with the baseline,
// until the images differ too much to be matched and a map has more holes than surface. After two
// such maps in a row the next smaller step is tried, and of the steps with recent maps the one with
// the highest mean confidence is used. Old measurements expire, and a wider step is tried again.
class AdaptiveBaseline {
 public:
  explicit AdaptiveBaseline(double max_ratio) : max_ratio_(max_ratio) {}

  // Baseline between neighbouring images over the median depth, at most.
  double ratio() const { return max_ratio_ * kShares.at(current_); }

  // The index of that step, 0 for the widest.
  std::size_t step() const { return current_; }

  // Of a bundle that was chosen with that step: the share of its pixels with an estimate, and the
  // mean confidence over all pixels.
  void ReportDepthQuality(std::size_t step, double density, double confidence);

 private:
  // In two steps the depth error of one pixel of matching error doubles.
  static constexpr std::array<double, 3> kShares = {1, 0.7071, 0.5};

  // The depth maps of one step.
  struct Quality {
    double confidence = 0;    // recursive mean
    int count = 0;            // of maps, up to kMaxCount
    std::int64_t latest = 0;  // the number of the last of them
  };

  bool IsRecent(std::size_t step) const;
  std::size_t BestStep() const;

  double max_ratio_;
  std::size_t current_ = 0;
  int num_poor_ = 0;  // of the current step, in a row
  std::int64_t num_reports_ = 0;
  std::array<std::optional<Quality>, kShares.size()> qualities_;
};

}  // namespace mono3d
