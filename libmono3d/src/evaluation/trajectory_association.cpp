// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/trajectory_association.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace mono3d {
namespace {

std::vector<std::size_t> OrderOfTime(std::span<const StampedPose> poses) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return poses[a].timestamp_s < poses[b].timestamp_s;
  });
  return order;
}

// The place in `order` of the pose that is nearest in time; of two equally near the earlier.
std::size_t Nearest(std::span<const StampedPose> poses, const std::vector<std::size_t>& order,
                    double time_s) {
  const auto upper = std::lower_bound(
      order.begin(), order.end(), time_s,
      [&](std::size_t index, double time) { return poses[index].timestamp_s < time; });
  if (upper == order.begin()) return 0;
  const auto lower = upper - 1;
  const auto place = static_cast<std::size_t>(lower - order.begin());
  if (upper == order.end()) return place;
  const double before_s = time_s - poses[*lower].timestamp_s;
  const double after_s = poses[*upper].timestamp_s - time_s;
  return before_s <= after_s ? place : place + 1;
}

struct Taker {
  std::size_t index = 0;
  double difference_s = 0;
};

// For each of the longer list, in order of time: who of the shorter list takes it.
std::vector<std::optional<Taker>> Takers(std::span<const StampedPose> shorter,
                                         std::span<const StampedPose> longer,
                                         const std::vector<std::size_t>& longer_order,
                                         double max_time_difference_s) {
  std::vector<std::optional<Taker>> takers(longer.size());
  if (longer.empty()) return takers;
  for (const std::size_t i : OrderOfTime(shorter)) {
    const double time_s = shorter[i].timestamp_s;
    const std::size_t place = Nearest(longer, longer_order, time_s);
    const double difference_s = std::abs(longer[longer_order[place]].timestamp_s - time_s);
    std::optional<Taker>& taker = takers[place];
    if (difference_s > max_time_difference_s) continue;
    if (!taker || difference_s < taker->difference_s) taker = Taker{i, difference_s};
  }
  return takers;
}

}  // namespace

std::vector<PosePair> AssociateByTime(std::span<const StampedPose> estimate,
                                      std::span<const StampedPose> truth,
                                      double max_time_difference_s) {
  const bool truth_is_longer = truth.size() > estimate.size();
  const auto shorter = truth_is_longer ? estimate : truth;
  const auto longer = truth_is_longer ? truth : estimate;
  const std::vector<std::size_t> order = OrderOfTime(longer);
  const auto takers = Takers(shorter, longer, order, max_time_difference_s);
  std::vector<PosePair> pairs;
  for (std::size_t place = 0; place < takers.size(); ++place) {
    if (!takers[place]) continue;
    const std::size_t of_longer = order[place];
    const std::size_t of_shorter = takers[place]->index;
    pairs.push_back(truth_is_longer ? PosePair{of_shorter, of_longer}
                                    : PosePair{of_longer, of_shorter});
  }
  return pairs;
}

}  // namespace mono3d
