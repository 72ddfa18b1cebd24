// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tracking/start/motion_selection.h"
#include "tracking/start/two_view_start.h"

namespace mono3d::tracking {

// What the start of a map is made of.
struct MapStart {
  View first;
  View second;
  TwoViewStart motion;  // from the first to the second
};

// Waits, over the views of a video, for two from which a map can start. It keeps views of the past,
// the older the sparser, and tries the oldest that still shares enough with the newest within the
// search radius: that has the most parallax. Where the image moves further than that from one view
// to the next, it tries the last one, at the shift that most of the image shares.
class MapInitialiser {
 public:
  MapInitialiser(const InitialisationOptions& options, int seed) : options_(options), seed_(seed) {}

  // The start that the view makes possible, or nothing and a `reason`.
  std::optional<MapStart> Add(View view, std::string& reason);
  // For the archives of image/state_archive.h; of a tracker with this camera and so many levels of
  // features.
  template <typename Archive>
  void ExchangeState(Archive& archive, const CameraModel& camera, int num_levels);

 private:
  std::optional<TwoViewStart> Try(std::size_t first, const View& view, bool can_wait,
                                  std::string& reason) const;
  void NoteImageMotion(View& view);
  std::size_t FirstThatShares(const View& view, std::string& reason) const;
  std::vector<BetweenView> SupportViews(std::size_t first, const View& view) const;
  std::vector<FeatureMatch> MatchNear(const View& a, const View& b) const;
  std::vector<FeatureMatch> Match(const View& a, const View& b) const;
  void Keep(View view);

  InitialisationOptions options_;
  int seed_;
  std::vector<View> views_;     // by time
  bool is_first_lost_ = false;  // the first of them shared too little with the last one already
};

}  // namespace mono3d::tracking
