// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/sgm_reference.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace mono3d::reference {
namespace {

constexpr std::array<std::array<int, 2>, 8> kSgmDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, -1}}};

// L(p, .) from L(q, .) of the pixel before on the path.
std::vector<int> Step(const std::uint8_t* cost, const std::vector<int>& before, int p1, int p2) {
  const int least = *std::min_element(before.begin(), before.end());
  std::vector<int> path(before.size());
  for (std::size_t d = 0; d < before.size(); ++d) {
    int best = std::min(before[d], least + p2);
    if (d > 0) best = std::min(best, before[d - 1] + p1);
    if (d + 1 < before.size()) best = std::min(best, before[d + 1] + p1);
    path[d] = cost[d] + best - least;
  }
  return path;
}

}  // namespace

std::vector<std::uint16_t> AggregateCosts(const std::vector<std::uint8_t>& costs,
                                          const cv::Mat& grey, int num_planes, int p1,
                                          const std::array<std::uint32_t, 256>& jump_penalties) {
  const auto planes = static_cast<std::size_t>(num_planes);
  const cv::Rect image(0, 0, grey.cols, grey.rows);
  std::vector<std::uint16_t> sums(costs.size(), 0);
  for (const auto& [dx, dy] : kSgmDirections) {
    // L of all pixels, visited such that the pixel before on the path comes first.
    std::vector<std::vector<int>> paths(static_cast<std::size_t>(image.area()));
    for (int i = 0; i < image.area(); ++i) {
      const bool backwards = dy < 0 || (dy == 0 && dx < 0);
      const int index = backwards ? image.area() - 1 - i : i;
      const cv::Point p(index % grey.cols, index / grey.cols);
      const cv::Point q(p.x - dx, p.y - dy);
      const std::uint8_t* cost = costs.data() + static_cast<std::size_t>(index) * planes;
      auto& path = paths[static_cast<std::size_t>(index)];
      if (image.contains(q)) {
        const int difference = std::abs(grey.at<std::uint8_t>(p) - grey.at<std::uint8_t>(q));
        path = Step(cost, paths[static_cast<std::size_t>(q.y * grey.cols + q.x)], p1,
                    static_cast<int>(jump_penalties[static_cast<std::size_t>(difference)]));
      } else {
        path.assign(cost, cost + planes);
      }
      for (std::size_t d = 0; d < planes; ++d) {
        auto& sum = sums[static_cast<std::size_t>(index) * planes + d];
        sum = static_cast<std::uint16_t>(sum + path[d]);
      }
    }
  }
  return sums;
}

}  // namespace mono3d::reference
