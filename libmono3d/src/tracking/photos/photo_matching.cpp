// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_matching.h"

#include <algorithm>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>

#include "mono3d/geometry/two_view_ransac.h"

namespace mono3d::tracking {
namespace {

// Of descriptors of the same surface, distance 0.7 of vectors of unit length.
constexpr float kMinCosine = 1 - 0.5F * 0.7F * 0.7F;
// Largest features that tell which photos look alike.
constexpr std::size_t kNumPreemptive = 300;
constexpr std::size_t kMinPreemptive = 4;
// Wrong pairs agree with an epipolar geometry by chance, but not as many of them.
constexpr double kMinEpipolarShare = 0.3;

struct BestCosine {
  float best = -1;
  float second = -1;
  Eigen::Index index = -1;

  void Take(float cosine, Eigen::Index of) {
    if (cosine > best) {
      second = best;
      best = cosine;
      index = of;
    } else if (cosine > second) {
      second = cosine;
    }
  }
  // Squared distances are 2 - 2 cosines.
  bool IsClear() const {
    constexpr auto kRatio = static_cast<float>(kMaxDistanceRatio * kMaxDistanceRatio);
    return best >= kMinCosine && 1 - best < kRatio * (1 - second);
  }
};

// On all processors: act(i) for each i below `size`.
template <typename Act>
void ForEachInParallel(std::size_t size, const Act& act) {
  cv::parallel_for_({0, static_cast<int>(size)}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) act(static_cast<std::size_t>(i));
  });
}

std::vector<std::pair<std::size_t, std::size_t>> AllPhotoPairs(std::size_t num_photos) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < num_photos; ++a) {
    for (std::size_t b = a + 1; b < num_photos; ++b) pairs.emplace_back(a, b);
  }
  return pairs;
}

std::optional<PhotoPair> Verified(const std::vector<PhotoFeatures>& photos, std::size_t a,
                                  std::size_t b, const PhotoMapperOptions& options) {
  const std::vector<FeatureMatch> matches =
      MatchPhotoFeatures(photos[a], photos[b], std::numeric_limits<std::size_t>::max());
  if (static_cast<int>(matches.size()) < options.min_matches) return std::nullopt;
  std::vector<PointPair> pairs;
  double sum_sigma = 0;
  for (const FeatureMatch& match : matches) {
    pairs.push_back({photos[a].pixels[match.feature_a], photos[b].pixels[match.feature_b]});
    sum_sigma += photos[a].sigma_px[match.feature_a] + photos[b].sigma_px[match.feature_b];
  }
  TwoViewRansacOptions ransac;
  ransac.seed = options.seed;
  // Lenses that are not known exactly bend the lines.
  ransac.sigma_px = 2 * 0.5 * sum_sigma / static_cast<double>(matches.size());
  const std::optional<TwoViewModel> F = EstimateFundamental(pairs, ransac);
  if (!F || F->num_inliers < options.min_matches ||
      F->num_inliers < kMinEpipolarShare * static_cast<double>(matches.size())) {
    return std::nullopt;
  }
  PhotoPair pair{a, b, {}};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (F->is_inlier[i] != 0) pair.matches.push_back(matches[i]);
  }
  return pair;
}

}  // namespace

std::vector<FeatureMatch> MatchPhotoFeatures(const PhotoFeatures& a, const PhotoFeatures& b,
                                             std::size_t max_features) {
  constexpr Eigen::Index kBlockRows = 128;  // of the matrix of cosines, which is never whole
  const auto num_a = static_cast<Eigen::Index>(std::min(a.size(), max_features));
  const auto num_b = static_cast<Eigen::Index>(std::min(b.size(), max_features));
  if (num_a < 2 || num_b < 2) return {};
  std::vector<BestCosine> of_a(static_cast<std::size_t>(num_a));
  std::vector<BestCosine> of_b(static_cast<std::size_t>(num_b));
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> cosines;
  for (Eigen::Index first = 0; first < num_a; first += kBlockRows) {
    const Eigen::Index rows = std::min(kBlockRows, num_a - first);
    cosines.noalias() =
        a.descriptors.middleRows(first, rows) * b.descriptors.topRows(num_b).transpose();
    for (Eigen::Index i = 0; i < rows; ++i) {
      const float* row = cosines.data() + i * num_b;
      BestCosine& best = of_a[static_cast<std::size_t>(first + i)];
      for (Eigen::Index k = 0; k < num_b; ++k) {
        best.Take(row[k], k);
        of_b[static_cast<std::size_t>(k)].Take(row[k], first + i);
      }
    }
  }
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].IsClear()) continue;
    const auto k = static_cast<std::size_t>(of_a[i].index);
    if (!of_b[k].IsClear() || of_b[k].index != static_cast<Eigen::Index>(i)) continue;
    matches.push_back({i, k});
  }
  return matches;
}

std::vector<std::pair<std::size_t, std::size_t>> ChoosePhotoPairs(
    const std::vector<PhotoFeatures>& photos, const PhotoMapperOptions& options) {
  const std::size_t size = photos.size();
  std::vector<std::pair<std::size_t, std::size_t>> all = AllPhotoPairs(size);
  if (size <= static_cast<std::size_t>(options.max_exhaustive)) return all;
  std::vector<std::size_t> votes(all.size());
  ForEachInParallel(all.size(), [&](std::size_t i) {
    votes[i] =
        MatchPhotoFeatures(photos[all[i].first], photos[all[i].second], kNumPreemptive).size();
  });
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> partners(size);  // votes, photo
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (votes[i] < kMinPreemptive) continue;
    const auto& [a, b] = all[i];
    partners[a].emplace_back(votes[i], b);
    partners[b].emplace_back(votes[i], a);
  }
  std::set<std::pair<std::size_t, std::size_t>> chosen;
  for (std::size_t a = 0; a < size; ++a) {
    std::ranges::stable_sort(partners[a],
                             [](const auto& l, const auto& r) { return l.first > r.first; });
    if (partners[a].size() > static_cast<std::size_t>(options.num_partners)) {
      partners[a].resize(static_cast<std::size_t>(options.num_partners));
    }
    for (const auto& [shared, b] : partners[a]) chosen.emplace(std::min(a, b), std::max(a, b));
  }
  return {chosen.begin(), chosen.end()};
}

std::vector<PhotoPair> MatchPhotos(const std::vector<PhotoFeatures>& photos,
                                   const PhotoMapperOptions& options) {
  const auto chosen = ChoosePhotoPairs(photos, options);
  std::vector<std::optional<PhotoPair>> verified(chosen.size());
  ForEachInParallel(chosen.size(), [&](std::size_t i) {
    verified[i] = Verified(photos, chosen[i].first, chosen[i].second, options);
  });
  std::vector<PhotoPair> pairs;
  for (std::optional<PhotoPair>& pair : verified) {
    if (pair) pairs.push_back(*std::move(pair));
  }
  return pairs;
}

}  // namespace mono3d::tracking
