// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "mono3d/geometry/homography.h"
#include "mono3d/tracking/photo_mapper.h"
#include "tracking/features/matching.h"
#include "tracking/photos/photo_features.h"

namespace mono3d::tracking {

// Two photos, a < b, and the features that show the same.
struct PhotoPair {
  std::size_t a = 0;
  std::size_t b = 0;
  std::vector<FeatureMatch> matches;
};

// Features most similar to each other, the second best farther by the ratio 0.8 (Lowe 2004), among
// the first `max_features` of either photo. O(n^2).
std::vector<FeatureMatch> MatchPhotoFeatures(const PhotoFeatures& a, const PhotoFeatures& b,
                                             std::size_t max_features);

// The pairs of photos that are worth matching: all, or of each photo those that share most of the
// largest features (preemptive matching: Wu 2013). In the order of a, then b.
std::vector<std::pair<std::size_t, std::size_t>> ChoosePhotoPairs(
    const std::vector<PhotoFeatures>& photos, const PhotoMapperOptions& options);

// The matches of two photos that one epipolar geometry explains; nothing where there are too few.
std::optional<PhotoPair> MatchPhotoPair(const std::vector<PhotoFeatures>& photos, std::size_t a,
                                        std::size_t b, const PhotoMapperOptions& options);

// Those pairs whose matches one epipolar geometry explains, with these matches alone.
std::vector<PhotoPair> MatchPhotos(const std::vector<PhotoFeatures>& photos,
                                   const PhotoMapperOptions& options);

// The pairs with as many more matches as their epipolar geometry makes clear: what looks alike
// elsewhere in a photo does not count. More of them are wrong than of those before: positions of
// photos that hang together without them become 5 to 40 % worse.
std::vector<PhotoPair> MatchAlongEpipolarLines(const std::vector<PhotoFeatures>& photos,
                                               std::vector<PhotoPair> pairs,
                                               const PhotoMapperOptions& options);

}  // namespace mono3d::tracking
