// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/image/frame_images.h"
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

  // Takes the next finalised keyframe, in the order in which the tracker made them; returns a
  // bundle when one is complete. `poses` are the tracker's of this moment: every keyframe that is
  // still to become part of a bundle is where they have it. A keyframe without sparse depths or
  // without a pose cannot be judged and is passed over. Keyframes of different maps never come into
  // one bundle. Nothing depends on the keyframes' time stamps.
  [[nodiscard]] virtual std::optional<ImageBundle> Add(const Keyframe& keyframe,
                                                       const KeyframePoses& poses) = 0;

  // No keyframe comes any more: the bundles that could have become better with later ones. By
  // default none.
  [[nodiscard]] virtual std::vector<ImageBundle> Finish(const KeyframePoses& /*poses*/) {
    return {};
  }

  // The quality of the depth map of an earlier bundle, so that the next bundles may be chosen
  // accordingly. By default it is ignored.
  virtual void ReportDepthQuality(const DepthQuality& /*quality*/) {}

  // What the keyframes so far had to offer, in words: "12 keyframes, baseline 0.004 of the depth at
  // most". By default empty.
  virtual std::string Findings() const { return {}; }

  // All that the selector knows, so that a run which was broken off goes on; a sequence of
  // sections, see core/state_sections.h. Throws Error where a selector cannot.
  virtual std::string SaveState(SavedImages images = SavedImages::kIncluded) const;
  // Before the first keyframe, by a selector made with the same options: takes over what SaveState
  // has returned; `where` names the bytes in messages. With the next keyframes the selector goes on
  // as that one would have, to the bit. `images` gives the images of a state that was saved without
  // them: of the latest 40 keyframes at most, where there is an order. Throws UsageError after the
  // first keyframe, under other options and without the images it needs, Error on anything that
  // SaveState has not made; after either the selector must not be used any more.
  virtual void RestoreState(std::string_view bytes, const std::string& where,
                            const ImageOfFrame& images = {});
};

// Baselines are given over the median depth of the scene in view, measured anew for each keyframe,
// so that nothing depends on the scale of the map or on its drift.
struct KeyframeSelectorOptions {
  int num_images = static_cast<int>(kBundleSize);  // of a bundle: 3, 5, 7 or 9 (paper: 5)
  // Between neighbouring images at the points that they share (paper: 5 at most). Wider is more
  // exact, narrower leaves fewer holes. Images at other angles are taken where there are none like
  // that.
  double best_angle_deg = 3;
  // Between an image and the reference: surfaces that are seen under angles like this by two
  // images look too different to be matched well.
  double max_angle_deg = 30;
  // Between neighbouring images (paper). Bundles with less are made of places that no other bundle
  // shows, once no better one can come.
  double min_baseline_ratio = 0.02;
  // After maps with more holes than surface bundles of narrower steps are tried, down to half of
  // the best angle; those of the most confident surface stay.
  bool adapt_baseline = true;
  // Between the references of two bundles: tan(5 degrees), so that each depth map shows something
  // new. They lie nearer where the second one shows new surface besides, or shows it larger.
  double min_reference_baseline_ratio = 0.0875;
  // Share of the picture that such new surface takes.
  double min_new_share = 0.25;
  // Photographs: any of them may be the best view of any other, so that all are kept, and bundles
  // are made in Finish. Not among the listed options: PipelineOptions::are_photos sets it.
  bool is_unordered = false;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The best views of each reference among the latest keyframes, 40 or as many as have images of
// 256 MB together, but at least three bundles: by the points that they share with it, the angles
// under which they see them, and likeness of size and upright direction; on both sides of the
// reference where there are any. Of unordered ones, among all.
std::unique_ptr<KeyframeSelector> CreateKeyframeSelector(
    const KeyframeSelectorOptions& options = {});

}  // namespace mono3d
