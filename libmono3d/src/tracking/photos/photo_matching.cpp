// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_matching.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>

#include "mono3d/geometry/two_view_ransac.h"
#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

// Of descriptors of the same surface, distance 0.7 of vectors of unit length.
constexpr double kMinCosine = 1 - 0.5 * 0.7 * 0.7;
// Largest features that tell which photos look alike.
constexpr std::size_t kNumPreemptive = 300;
constexpr std::size_t kMinPreemptive = 4;
// Wrong pairs agree with an epipolar geometry by chance, but not as many of them.
constexpr double kMinEpipolarShare = 0.3;

// The most similar feature, where it is similar enough and the second best clearly less so.
// Squared distances are 2 - 2 cosines.
std::optional<std::size_t> ClearlyBest(const MostSimilar& similar, std::size_t feature) {
  constexpr double kRatio = kMaxDistanceRatio * kMaxDistanceRatio;
  const double best = similar.best[feature] / kProductOfUnit;
  const double second = similar.second[feature] / kProductOfUnit;
  if (best < kMinCosine || 1 - best >= kRatio * (1 - second)) return std::nullopt;
  return static_cast<std::size_t>(similar.index[feature]);
}

// Features that are each other's best, both clearly.
std::vector<FeatureMatch> MatchesOfBest(const SimilarFeatures& similar, std::size_t num_a) {
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < num_a; ++i) {
    const auto k = ClearlyBest(similar.of_a, i);
    if (k && ClearlyBest(similar.of_b, *k) == i) matches.push_back({i, *k});
  }
  return matches;
}

// On all processors: act(i) for each i below `size`.
template <typename Act>
void ForEachInParallel(std::size_t size, const Act& act) {
  cv::parallel_for_({0, static_cast<int>(size)}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) act(static_cast<std::size_t>(i));
  });
}

// The same of pairs: tells how far it is, and leaves the rest out when it is to stop.
template <typename Act>
void ForEachPair(std::size_t size, const PhotoMapperOptions& options, const Act& act) {
  std::mutex mutex;
  std::int64_t num_done = 0;
  ForEachInParallel(size, [&](std::size_t i) {
    if (options.IsStopped()) return;
    act(i);
    if (!options.on_progress) return;
    const std::lock_guard lock(mutex);
    options.on_progress(
        {PhotoMapperProgress::Step::kMatching, ++num_done, static_cast<std::int64_t>(size)});
  });
}

std::vector<std::pair<std::size_t, std::size_t>> AllPhotoPairs(std::size_t num_photos) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < num_photos; ++a) {
    for (std::size_t b = a + 1; b < num_photos; ++b) pairs.emplace_back(a, b);
  }
  return pairs;
}

// Lines a x + b y + c = 0 of the features in the other photo, in px.
Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> EpipolarLines(
    const PhotoFeatures& photo, const Eigen::Matrix3d& F_other_photo) {
  Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> lines(photo.size(), 3);
  for (std::size_t i = 0; i < photo.size(); ++i) {
    const Eigen::Vector3d line = F_other_photo * photo.pixels[i].homogeneous();
    lines.row(static_cast<Eigen::Index>(i)) = (line / line.head<2>().norm()).cast<float>();
  }
  return lines;
}

// As MatchPhotoFeatures, but only features that lie on each other's epipolar line vie for a match:
// what looks alike elsewhere in the photo, as windows and cupboards do, rules none out.
std::vector<FeatureMatch> MatchOnEpipolarLines(const PhotoFeatures& a, const PhotoFeatures& b,
                                               const Eigen::Matrix3d& F_b_a,
                                               double max_distance_px) {
  const auto lines_in_b = EpipolarLines(a, F_b_a);
  const auto lines_in_a = EpipolarLines(b, F_b_a.transpose());
  const auto max_distance = static_cast<float>(max_distance_px);
  SimilarFeatures similar{MostSimilar(a.size()), MostSimilar(b.size())};
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto row_a = static_cast<Eigen::Index>(i);
    const Eigen::RowVector3f line_in_b = lines_in_b.row(row_a);
    const Eigen::Vector3f pixel_a = a.pixels[i].homogeneous().cast<float>();
    for (std::size_t k = 0; k < b.size(); ++k) {
      const auto row_b = static_cast<Eigen::Index>(k);
      const Eigen::Vector3f pixel_b = b.pixels[k].homogeneous().cast<float>();
      if (std::abs(line_in_b.dot(pixel_b)) > max_distance) continue;
      if (std::abs(lines_in_a.row(row_b).dot(pixel_a)) > max_distance) continue;
      const std::int32_t product = DescriptorProduct(a.descriptors, row_a, b.descriptors, row_b);
      similar.of_a.Take(i, product, static_cast<std::int32_t>(k));
      similar.of_b.Take(k, product, static_cast<std::int32_t>(i));
    }
  }
  return MatchesOfBest(similar, a.size());
}

struct EpipolarGeometry {
  TwoViewModel model;
  double sigma_px = 0;
};

std::optional<EpipolarGeometry> FitEpipolarGeometry(const PhotoFeatures& a, const PhotoFeatures& b,
                                                    const std::vector<FeatureMatch>& matches,
                                                    int seed) {
  std::vector<PointPair> pairs;
  double sum_sigma = 0;
  for (const FeatureMatch& match : matches) {
    pairs.push_back({a.pixels[match.feature_a], b.pixels[match.feature_b]});
    sum_sigma += a.sigma_px[match.feature_a] + b.sigma_px[match.feature_b];
  }
  TwoViewRansacOptions ransac;
  ransac.seed = seed;
  // Lenses that are not known exactly bend the lines.
  ransac.sigma_px = 2 * 0.5 * sum_sigma / static_cast<double>(matches.size());
  std::optional<TwoViewModel> F = EstimateFundamental(pairs, ransac);
  if (!F) return std::nullopt;
  return EpipolarGeometry{*std::move(F), ransac.sigma_px};
}

}  // namespace

std::vector<FeatureMatch> MatchPhotoFeatures(const PhotoFeatures& a, const PhotoFeatures& b,
                                             std::size_t max_features) {
  const std::size_t num_a = std::min(a.size(), max_features);
  const std::size_t num_b = std::min(b.size(), max_features);
  if (num_a < 2 || num_b < 2) return {};
  return MatchesOfBest(FindMostSimilar(a.descriptors, num_a, b.descriptors, num_b), num_a);
}

std::vector<std::pair<std::size_t, std::size_t>> ChoosePhotoPairs(
    const std::vector<PhotoFeatures>& photos, const PhotoMapperOptions& options) {
  const std::size_t size = photos.size();
  std::vector<std::pair<std::size_t, std::size_t>> all = AllPhotoPairs(size);
  if (size <= static_cast<std::size_t>(options.max_exhaustive)) return all;
  std::vector<std::size_t> votes(all.size());
  ForEachInParallel(all.size(), [&](std::size_t i) {
    if (options.IsStopped()) return;
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

std::optional<PhotoPair> MatchPhotoPair(const std::vector<PhotoFeatures>& photos, std::size_t a,
                                        std::size_t b, const PhotoMapperOptions& options) {
  const std::vector<FeatureMatch> matches =
      MatchPhotoFeatures(photos[a], photos[b], std::numeric_limits<std::size_t>::max());
  if (static_cast<int>(matches.size()) < options.min_matches) return std::nullopt;
  const auto geometry = FitEpipolarGeometry(photos[a], photos[b], matches, options.seed);
  if (!geometry || geometry->model.num_inliers < options.min_matches ||
      geometry->model.num_inliers < kMinEpipolarShare * static_cast<double>(matches.size())) {
    return std::nullopt;
  }
  PhotoPair pair{a, b, {}};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (geometry->model.is_inlier[i] != 0) pair.matches.push_back(matches[i]);
  }
  return pair;
}

std::vector<PhotoPair> MatchPhotos(const std::vector<PhotoFeatures>& photos,
                                   const PhotoMapperOptions& options) {
  const auto chosen = ChoosePhotoPairs(photos, options);
  std::vector<std::optional<PhotoPair>> verified(chosen.size());
  ForEachPair(chosen.size(), options, [&](std::size_t i) {
    verified[i] = MatchPhotoPair(photos, chosen[i].first, chosen[i].second, options);
  });
  std::vector<PhotoPair> pairs;
  for (std::optional<PhotoPair>& pair : verified) {
    if (pair) pairs.push_back(*std::move(pair));
  }
  return pairs;
}

std::vector<PhotoPair> MatchAlongEpipolarLines(const std::vector<PhotoFeatures>& photos,
                                               std::vector<PhotoPair> pairs,
                                               const PhotoMapperOptions& options) {
  ForEachPair(pairs.size(), options, [&](std::size_t i) {
    PhotoPair& pair = pairs[i];
    const PhotoFeatures& a = photos[pair.a];
    const PhotoFeatures& b = photos[pair.b];
    const auto geometry = FitEpipolarGeometry(a, b, pair.matches, options.seed);
    if (!geometry) return;
    const double max_distance_px = std::sqrt(kChi2OneDof) * geometry->sigma_px;
    std::vector<FeatureMatch> matches =
        MatchOnEpipolarLines(a, b, geometry->model.matrix, max_distance_px);
    if (matches.size() > pair.matches.size()) pair.matches = std::move(matches);
  });
  return pairs;
}

}  // namespace mono3d::tracking
