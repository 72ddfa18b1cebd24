// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <optional>

#include "mono3d/core/options.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

// Chooses the bundles of five images from which depth is estimated (paper, section 3.1).
class KeyframeSelector {
 public:
  virtual ~KeyframeSelector() = default;

  // Takes the next settled keyframe, in the order of flight; returns a bundle when one is complete.
  [[nodiscard]] virtual std::optional<ImageBundle> Add(const Keyframe& keyframe) = 0;
};

struct KeyframeSelectorOptions {
  double max_rotation_deg = 5;       // between neighbouring images (paper)
  double min_baseline_ratio = 0.02;  // baseline over median scene depth between neighbours (paper)

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

std::unique_ptr<KeyframeSelector> CreateKeyframeSelector(
    const KeyframeSelectorOptions& options = {});

}  // namespace mono3d
