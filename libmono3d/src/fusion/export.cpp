// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/export.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "fusion/isolated_surfels.h"
#include "mono3d/core/statistics.h"
#include "mono3d/fusion/confidence_histogram.h"
#include "mono3d/geometry/voxel_grid.h"

namespace mono3d {
namespace {

// Depth is matched by windows of pixels: a surface never brings one surfel alone. What stands alone
// is a mismatch that nothing has contradicted yet. Eight: the pixels around one.
constexpr int kMinNeighbours = 8;

// Places that fill gaps are as far from all that is surer. Nearer ones are mostly the uncertain
// edges of surfaces that are there already.
constexpr double kGapRadii = 1.5;

// Where depth maps infer the same, this many make it more likely to be right; more of them do not,
// as measured against true depth maps.
constexpr float kMostGuesses = 4;

float Against(const Surfels::Uint4& history) {
  return static_cast<float>(SeenThroughAgainst(history) + HiddenAgainst(history)) / 256.0F;
}

float For(const Surfels::Uint4& history) {
  return static_cast<float>(ConfidenceFor(history)) / 256.0F;
}

// Does more speak against it than for it? What stands before a surface that two depth maps agree on
// hides it, as a house hides what is behind it; of one that a single depth map claims, it may as
// well be the true one.
bool IsDisputed(const Surfels::Uint4& history) {
  const std::uint32_t hidden = Low16(history[1]) > 1 ? 0 : HiddenAgainst(history);
  return SeenThroughAgainst(history) + hidden > ConfidenceFor(history);
}

// The rule of succession with one doubt to begin with: a single observation is not certain.
// Depth maps that infer a surface do so from the same outline and err alike: of so many, only
// kMostGuesses count, by their mean.
float Confidence(const Surfels::Uint4& history, bool is_inferred) {
  float for_it = For(history);
  const auto observations = static_cast<float>(Low16(history[1]));
  if (is_inferred) for_it *= std::min(1.0F, kMostGuesses / observations);
  const float against_it = Against(history);
  return for_it / (for_it + against_it + 1);
}

std::uint8_t Colour8(std::uint32_t colour10) {
  return static_cast<std::uint8_t>(std::min((colour10 & 0x3FFU) + 2, 0x3FFU) / 4);
}

PointCloud Thinned(const PointCloud& cloud, double voxel_radii) {
  return ThinToVoxels(cloud, voxel_radii * UpperMedian(cloud.radii));
}

// Is it one that the options ask for, whatever its confidence?
bool IsWanted(const Surfels& surfels, std::size_t i, const SurfelExportOptions& options) {
  const auto& history = surfels.history[i];
  return !IsRemoved(surfels, i) &&
         static_cast<int>(Low16(history[1])) >= options.min_observations &&
         !(options.min_confidence > 0 && IsDisputed(history));
}

// From which confidence on matched surfels are exported.
double LimitOfConfidence(const SurfelParts& matched, const SurfelExportOptions& options) {
  ConfidenceHistogram histogram;
  matched.for_each([&](const Surfels& surfels) {
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      if (IsWanted(surfels, i, options)) histogram.Add(Confidence(surfels.history[i], false));
    }
  });
  return histogram.LimitFor(options);
}

// Of one kind of surfels, by their confidence.
struct ByConfidence {
  PointCloud sure;
  // Of gap_confidence alone. Of those that no depth map matched in full, only those that one
  // matched on a coarser level: what one infers from the surface around is too often wrong.
  PointCloud unsure;
};

// Adds the surfels that the options ask for, each by what it holds alone.
void AddChosen(const Surfels& surfels, bool is_inferred, std::span<const Similarity> S_world_anchor,
               std::span<const std::uint32_t> frames, const SurfelExportOptions& options,
               ByConfidence& chosen) {
  const auto limit = static_cast<float>(options.min_confidence);
  const auto gap_limit = static_cast<float>(options.gap_confidence);
  std::optional<std::uint32_t> last_anchor;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  double scale = 1;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const auto& history = surfels.history[i];
    const std::uint32_t observations = Low16(history[1]);
    const float confidence = Confidence(history, is_inferred);
    const bool fills_gaps = !is_inferred || IsCoarseMatch(history);
    const float least = fills_gaps ? std::min(limit, gap_limit) : limit;
    if (!IsWanted(surfels, i, options) || confidence < least) continue;
    PointCloud& cloud = confidence < limit ? chosen.unsure : chosen.sure;
    const auto& p = surfels.position_radius[i];
    const auto& n = surfels.normal_weight[i];
    const std::uint32_t anchor = AnchorOf(surfels, i);
    if (anchor != last_anchor) {
      last_anchor = anchor;
      R = S_world_anchor[anchor].pose().rotation().toRotationMatrix();
      t = S_world_anchor[anchor].pose().translation();
      scale = S_world_anchor[anchor].scale();
    }
    cloud.points.emplace_back((R * (scale * Eigen::Vector3d(p[0], p[1], p[2])) + t).cast<float>());
    cloud.normals.emplace_back((R * Eigen::Vector3d(n[0], n[1], n[2])).cast<float>());
    cloud.colours.push_back(
        {Colour8(history[0]), Colour8(history[0] >> 10), Colour8(history[0] >> 20)});
    cloud.radii.push_back(static_cast<float>(scale * p[3]));
    cloud.confidences.push_back(confidence);
    cloud.observations.push_back(observations);
    cloud.first_frames.push_back(frames[FirstMapOf(surfels, i)]);
  }
}

// Does `act` with each list that an exported surfel has a member in.
template <typename Act>
void WithEachList(PointCloud& cloud, const Act& act) {
  act(cloud.points);
  act(cloud.normals);
  act(cloud.colours);
  act(cloud.radii);
  act(cloud.confidences);
  act(cloud.observations);
  act(cloud.first_frames);
}

ByConfidence Chosen(const SurfelParts& parts, bool is_inferred,
                    std::span<const Similarity> S_world_anchor,
                    std::span<const std::uint32_t> frames, const SurfelExportOptions& options) {
  ByConfidence chosen;
  // A list that has to grow is there twice, or three times, meanwhile; what is not written to takes
  // no memory.
  WithEachList(chosen.sure, [&](auto& values) { values.reserve(parts.num_at_most); });
  parts.for_each([&](const Surfels& surfels) {
    AddChosen(surfels, is_inferred, S_world_anchor, frames, options, chosen);
  });
  return chosen;
}

// Without the surfels that are marked. In its own memory: a model may take most of what there is.
PointCloud Without(const std::vector<bool>& is_left_out, PointCloud cloud) {
  WithEachList(cloud, [&](auto& values) {
    std::size_t num_kept = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!is_left_out[i]) values[num_kept++] = values[i];
    }
    values.resize(num_kept);
  });
  return cloud;
}

// Of the unsure surfels those that fill gaps between the sure ones: far enough from all of them,
// and with an expected error of no more scene units than gap_confidence means at the distance of
// the median sure surfel, of which radii tell. Two percent of a great distance is no surface.
PointCloud FillingGaps(PointCloud unsure, const PointCloud& sure, double gap_confidence) {
  if (unsure.empty() || sure.empty()) return unsure;
  std::vector<bool> is_left_out = FindNear(unsure, sure, kGapRadii);
  // Of one undisputed observation of confidence p, c = p / (p + 1), the error goes with 1 / p - 1.
  const auto error_of = [](double c) { return (1 - c) / c - 1; };
  const double most = error_of(gap_confidence) * UpperMedian(sure.radii);
  for (std::size_t i = 0; i < unsure.size(); ++i) {
    if (error_of(unsure.confidences[i]) * unsure.radii[i] > most) is_left_out[i] = true;
  }
  return Without(is_left_out, std::move(unsure));
}

PointCloud WithoutIsolated(PointCloud cloud) {
  const std::vector<bool> is_isolated = FindIsolated(cloud, kMinNeighbours, 0);
  return Without(is_isolated, std::move(cloud));
}

// Lists of `more` behind those of `cloud`, but for what is inferred.
void AppendSurfels(const PointCloud& more, PointCloud& cloud) {
  const auto append = [](const auto& from, auto& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(more.points, cloud.points);
  append(more.normals, cloud.normals);
  append(more.colours, cloud.colours);
  append(more.radii, cloud.radii);
  append(more.confidences, cloud.confidences);
  append(more.observations, cloud.observations);
  append(more.first_frames, cloud.first_frames);
}

// Of the inferred surfels those that say more than the matched ones and do not stand alone.
// `matched` is as it was afterwards: a copy of it might be all the memory that is left.
PointCloud BesideMatched(PointCloud inferred, PointCloud& matched) {
  const std::vector<bool> is_in_place = FindNear(inferred, matched, kFootprintRadii);
  PointCloud beside = Without(is_in_place, std::move(inferred));
  const std::size_t num_matched = matched.size();
  AppendSurfels(beside, matched);
  const std::vector<bool> is_isolated = FindIsolated(matched, kMinNeighbours, num_matched);
  WithEachList(matched, [&](auto& values) { values.resize(num_matched); });
  return Without(
      {is_isolated.begin() + static_cast<std::ptrdiff_t>(num_matched), is_isolated.end()},
      std::move(beside));
}

}  // namespace

PointCloud ToPointCloud(const Surfels& surfels, std::span<const Similarity> S_world_anchor,
                        std::span<const std::uint32_t> frames, const SurfelExportOptions& options) {
  return ToPointCloud(surfels, Surfels(), S_world_anchor, frames, options);
}

PointCloud ToPointCloud(const Surfels& matched, const Surfels& inferred,
                        std::span<const Similarity> S_world_anchor,
                        std::span<const std::uint32_t> frames, const SurfelExportOptions& options) {
  const auto all_of = [](const Surfels& surfels) {
    return SurfelParts{[&](const auto& take) { take(surfels); }, surfels.size()};
  };
  return ToPointCloud(Choose(all_of(matched), all_of(inferred), S_world_anchor, frames, options));
}

ChosenSurfels Choose(const SurfelParts& matched, const SurfelParts& inferred,
                     std::span<const Similarity> S_world_anchor,
                     std::span<const std::uint32_t> frames, const SurfelExportOptions& asked_for) {
  asked_for.Validate();
  ChosenSurfels chosen{{}, {}, {}, asked_for};
  SurfelExportOptions& options = chosen.options;
  ByConfidence by_confidence = Chosen(matched, false, S_world_anchor, frames, options);
  const double num_at_least = options.min_share * static_cast<double>(matched.num_at_most);
  if (options.min_confidence > 0 && static_cast<double>(by_confidence.sure.size()) < num_at_least) {
    const double limit = LimitOfConfidence(matched, options);
    if (limit < options.min_confidence) {
      options.min_confidence = limit;
      by_confidence = Chosen(matched, false, S_world_anchor, frames, options);
    }
  }
  chosen.matched = std::move(by_confidence.sure);
  chosen.unsure = std::move(by_confidence.unsure);
  by_confidence = Chosen(inferred, true, S_world_anchor, frames, options);
  AppendSurfels(by_confidence.unsure, chosen.unsure);
  if (options.with_inferred) chosen.inferred = std::move(by_confidence.sure);
  return chosen;
}

PointCloud ToPointCloud(ChosenSurfels chosen) {
  const SurfelExportOptions& options = chosen.options;
  PointCloud cloud = std::move(chosen.matched);
  PointCloud unsure = std::move(chosen.unsure);
  PointCloud guessed = std::move(chosen.inferred);
  unsure = FillingGaps(std::move(unsure), cloud, options.gap_confidence);
  AppendSurfels(unsure, cloud);
  if (options.min_confidence > 0) cloud = WithoutIsolated(std::move(cloud));
  if (options.min_confidence > 0 && !guessed.empty()) {
    guessed = BesideMatched(std::move(guessed), cloud);
  }
  if (options.voxel_radii > 0) {
    if (!cloud.empty()) cloud = Thinned(cloud, options.voxel_radii);
    if (!guessed.empty()) guessed = Thinned(guessed, options.voxel_radii);
  }
  if (guessed.empty()) return cloud;
  AppendSurfels(guessed, cloud);
  cloud.inferred.resize(cloud.size() - guessed.size(), 0);
  cloud.inferred.resize(cloud.size(), 1);
  return cloud;
}

}  // namespace mono3d
