// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "geometry/geometry_state.h"

namespace mono3d {

// The angle between neighbouring images of a bundle, adapted to the quality of the depth maps so
// far. It begins at the widest: the depth error falls with the angle, until the images differ too
// much to be matched and a map has more holes than surface. After two
// such maps in a row the next smaller step is tried, and of the steps with recent maps the one with
// the highest mean confidence is used. Old measurements expire, and a wider step is tried again.
class AdaptiveBaseline {
 public:
  explicit AdaptiveBaseline(double widest_deg) : widest_deg_(widest_deg) {}

  // Between neighbouring images, to be aimed at.
  double angle_deg() const { return widest_deg_ * kShares.at(current_); }

  // The index of that step, 0 for the widest.
  std::size_t step() const { return current_; }
  bool HasStep(std::size_t step) const { return step < kShares.size(); }

  // Of a bundle that was chosen with that step: the share of its pixels with an estimate, and the
  // mean confidence over all pixels.
  void ReportDepthQuality(std::size_t step, double density, double confidence);

  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive) {
    archive.Index(current_);
    archive.Number(num_poor_);
    ExchangeCount(archive, num_reports_);
    for (std::optional<Quality>& of_step : qualities_) {
      archive.Optional(of_step, [&](Quality& quality) {
        archive.Number(quality.confidence);
        archive.Number(quality.count);
        archive.Number(quality.latest);
      });
    }
    if constexpr (Archive::kReads) {
      if (current_ >= qualities_.size() || num_poor_ < 0 || num_poor_ > 1000) {
        archive.Refuse("contradicts itself");
      }
      for (const std::optional<Quality>& quality : qualities_) {
        if (quality && (quality->count < 0 || quality->count > 1000 || quality->latest < 0 ||
                        quality->latest > num_reports_)) {
          archive.Refuse("contradicts itself");
        }
      }
    }
  }

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

  double widest_deg_;
  std::size_t current_ = 0;
  int num_poor_ = 0;  // of the current step, in a row
  std::int64_t num_reports_ = 0;
  std::array<std::optional<Quality>, kShares.size()> qualities_;
};

}  // namespace mono3d
