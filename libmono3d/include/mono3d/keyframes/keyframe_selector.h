// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/image/image_bundle.h"
#include "mono3d/image/keyframe_poses.h"

namespace MONO3D_EXPORT mono3d {

// The quality of the depth map of a bundle.
struct DepthQuality {
  std::int64_t reference_id = 0;  // of the bundle's reference keyframe
  double density = 0;     // share of pixels with an estimate; 0 where there was no depth map
  double confidence = 0;  // mean over all pixels, 0 where there is no estimate
};

// Chooses the bundles of images from which depth is estimated (paper, section 3.1). Calls from one
// thread at a time.
class KeyframeSelector {
 public:
  virtual ~KeyframeSelector() = default;

  // Takes the next finalised keyframe, in the order of flight; returns a bundle when one is
  // complete. `poses` are the tracker's of this moment: every keyframe that is still to become part
  // of a bundle is where they have it. A keyframe without sparse depths or without a pose cannot be
  // judged and is passed over. A keyframe of another map starts afresh.
  [[nodiscard]] virtual std::optional<ImageBundle> Add(const Keyframe& keyframe,
                                                       const KeyframePoses& poses) = 0;

  // The quality of the depth map of an earlier bundle, so that the next bundles may be chosen
  // accordingly. By default it is ignored.
  virtual void ReportDepthQuality(const DepthQuality& /*quality*/) {}
};

// Baselines are given over the median depth of the scene in view, measured anew for each keyframe,
// so that nothing depends on the scale of the map or on its drift.
struct KeyframeSelectorOptions {
  int num_images = static_cast<int>(kBundleSize);  // of a bundle: 3, 5, 7 or 9 (paper: 5)
  double max_rotation_deg = 5;                     // between neighbouring images (paper)
  double min_baseline_ratio = 0.02;                // between neighbouring images (paper)
  // Between neighbouring images: tan(5 degrees), the baseline of an orbit's largest step, so that a
  // straight flight changes the viewing angle no more than an orbit does.
  double max_baseline_ratio = 0.0875;
  // After maps with more holes than surface bundles of narrower steps are tried, down to half of
  // the largest; those of the most confident surface stay.
  bool adapt_baseline = true;
  // Between the references of two bundles, so that each depth map shows something new.
  double min_reference_baseline_ratio = 0.0875;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

std::unique_ptr<KeyframeSelector> CreateKeyframeSelector(
    const KeyframeSelectorOptions& options = {});

}  // namespace mono3d
