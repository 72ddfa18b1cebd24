// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/source_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mono3d {
namespace {

// Less of the reference in view, and too little of it is matched with any pair of sources.
constexpr double kMinShare = 0.3;
// Census windows of surfaces seen at half or twice the size do not match.
constexpr double kMaxScale = 2;
// Neither do those of pictures turned by so much, beyond the quarter turns that windows follow.
constexpr double kMaxRoll_deg = 30;
// Two thirds of a pixel at f = 700 px and a third of a pixel of matching error: no depth.
constexpr double kNoBaselineRatio = 0.002;

// At half or twice the best angle a point counts 0.6.
const double kAngleSigma = std::log(2.0);
const double kScaleSigma = std::log(1.5);
constexpr double kRollSigma_deg = 15;

double Bell(double deviation) { return std::exp(-0.5 * deviation * deviation); }

struct Candidate {
  std::size_t index = 0;  // of the view
  CommonView common;
  std::size_t distance = 0;  // from the reference, in the list
  bool is_taken = false;
};

std::vector<Candidate> FindCandidates(const std::vector<const View*>& views, std::size_t reference,
                                      const KeyframePoses& poses, double max_angle_deg) {
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i == reference || !AreInOneMap(*views[reference], *views[i], poses)) continue;
    Candidate candidate{i, Compare(*views[reference], *views[i], poses),
                        i < reference ? reference - i : i - reference};
    if (!IsUsable(candidate.common, max_angle_deg)) continue;
    candidates.push_back(std::move(candidate));
  }
  std::ranges::stable_sort(candidates, {}, &Candidate::distance);
  return candidates;
}

using Candidates = std::vector<Candidate*>;

// Takes the best candidate for each angle in turn, as long as there are any.
std::vector<const Candidate*> Take(const Candidates& side, std::size_t num_sources,
                                   double step_deg) {
  std::vector<const Candidate*> taken;
  for (std::size_t i = 1; i <= num_sources; ++i) {
    Candidate* best = nullptr;
    double best_weight = -1;
    for (Candidate* candidate : side) {
      if (candidate->is_taken) continue;
      const double weight = SourceWeight(candidate->common, step_deg * static_cast<double>(i));
      if (weight <= best_weight) continue;
      best = candidate;
      best_weight = weight;
    }
    if (best == nullptr) break;
    best->is_taken = true;
    taken.push_back(best);
  }
  std::ranges::sort(taken, {}, [](const Candidate* c) { return c->common.angle_deg; });
  return taken;
}

// The two sides of the reference along the baseline to the best source.
struct Sides {
  Candidates first;
  Candidates second;
};

Sides SidesOf(const Candidates& candidates, double step_deg) {
  const auto weight = [&](const Candidate* c) { return SourceWeight(c->common, step_deg); };
  const Candidate& best = **std::ranges::max_element(candidates, {}, weight);
  Sides sides;
  for (Candidate* candidate : candidates) {
    const double along = candidate->common.baseline_su.dot(best.common.baseline_su);
    (along > 0 ? sides.first : sides.second).push_back(candidate);
  }
  return sides;
}

double LargestBaselineRatio(const std::vector<const Candidate*>& sources) {
  double largest = 0;
  for (const Candidate* source : sources) {
    largest = std::max(largest, source->common.baseline_ratio);
  }
  return largest;
}

std::vector<std::size_t> IndicesOf(const std::vector<const Candidate*>& sources) {
  std::vector<std::size_t> indices;
  for (const Candidate* source : sources) indices.push_back(source->index);
  return indices;
}

// Sources from near to far, nearer ones on the second side.
SourceChoice OnOneSide(const std::vector<const Candidate*>& sources) {
  const auto num_near = static_cast<std::ptrdiff_t>((sources.size() + 1) / 2);
  SourceChoice choice;
  choice.second = IndicesOf({sources.begin(), sources.begin() + num_near});
  choice.first = IndicesOf({sources.begin() + num_near, sources.end()});
  choice.grade = SourceGrade::kOneSided;
  choice.baseline_ratio = LargestBaselineRatio(sources);
  return choice;
}

std::optional<SourceChoice> Choose(const Candidates& candidates,
                                   const SourceChoiceOptions& options) {
  if (candidates.size() < 2) return std::nullopt;
  const Sides sides = SidesOf(candidates, options.step_deg);
  const std::size_t per_side = options.num_sources / 2;
  if (sides.first.empty() || sides.second.empty()) {
    return OnOneSide(Take(candidates, options.num_sources, 0.5 * options.step_deg));
  }
  const auto first = Take(sides.first, per_side, options.step_deg);
  const auto second = Take(sides.second, per_side, options.step_deg);
  SourceChoice choice;
  choice.first = IndicesOf(first);
  choice.second = IndicesOf(second);
  choice.grade = SourceGrade::kGood;
  choice.baseline_ratio = std::max(LargestBaselineRatio(first), LargestBaselineRatio(second));
  return choice;
}

// In the order of the list, outermost ones at the ends, the side that begins first in front.
void Order(SourceChoice& choice) {
  if (choice.grade == SourceGrade::kOneSided) return;
  if (std::ranges::min(choice.second) < std::ranges::min(choice.first)) {
    std::swap(choice.first, choice.second);
  }
  std::ranges::reverse(choice.first);
}

}  // namespace

bool IsUsable(const CommonView& common, double max_angle_deg) {
  return common.share >= kMinShare && common.angle_deg <= max_angle_deg &&
         common.scale <= kMaxScale && common.scale >= 1 / kMaxScale &&
         common.roll_deg <= kMaxRoll_deg && common.baseline_ratio >= kNoBaselineRatio;
}

double SourceWeight(const CommonView& common, double angle_deg) {
  if (common.angles_deg.empty()) return 0;
  double sum = 0;
  for (const double angle : common.angles_deg) {
    sum += angle > 0 ? Bell(std::log(angle / angle_deg) / kAngleSigma) : 0;
  }
  return common.share * sum / static_cast<double>(common.angles_deg.size()) *
         Bell(std::log(common.scale) / kScaleSigma) * Bell(common.roll_deg / kRollSigma_deg);
}

std::optional<SourceChoice> ChooseSources(const std::vector<const View*>& views,
                                          std::size_t reference, const KeyframePoses& poses,
                                          const SourceChoiceOptions& options) {
  std::vector<Candidate> candidates =
      FindCandidates(views, reference, poses, options.max_angle_deg);
  Candidates all;
  Candidates wide;
  for (Candidate& candidate : candidates) {
    all.push_back(&candidate);
    if (candidate.common.baseline_ratio >= options.min_baseline_ratio) wide.push_back(&candidate);
  }
  const double least = 0.5 * static_cast<double>(options.num_sources) * options.min_baseline_ratio;
  std::optional<SourceChoice> choice = Choose(wide, options);
  if (choice && choice->baseline_ratio >= least) {
    Order(*choice);
    return choice;
  }
  for (Candidate& candidate : candidates) candidate.is_taken = false;
  choice = Choose(all, options);
  if (!choice) return std::nullopt;
  Order(*choice);
  choice->grade = SourceGrade::kWeak;
  return choice;
}

}  // namespace mono3d
