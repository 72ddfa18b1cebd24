// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/view_choice.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <unordered_map>
#include <utility>

namespace mono3d {
namespace {

// What a border between two views costs for each edge, beside what a view costs: the share of the
// resolution that is lost against the best one, 0 to 1. A tenth of the resolution is then worth as
// much as a border at a tenth of the edges.
constexpr float kBorderCost = 1;

using Costs = std::array<float, TriangleViews::kMost>;

// Min-sum belief propagation over the triangles in their order, forwards and backwards.
class ViewPropagation {
 public:
  ViewPropagation(const TriangleViews& views, const TriangleNeighbours& neighbours)
      : views_(views), neighbours_(neighbours), messages_(neighbours.size()) {
    for (auto& message : messages_) {
      for (Costs& costs : message) costs.fill(0);
    }
  }

  void Sweep() {
    const std::size_t count = neighbours_.size();
    for (std::size_t i = 0; i < count; ++i) Send(i);
    for (std::size_t i = count; i-- > 0;) Send(i);
  }

  std::vector<std::uint32_t> Best() const {
    std::vector<std::uint32_t> best(neighbours_.size(), kNoView);
    for (std::size_t i = 0; i < neighbours_.size(); ++i) {
      const auto of = views_.Of(i);
      if (of.empty()) continue;
      const Costs costs = CostsOf(i);
      const auto least =
          std::min_element(costs.begin(), costs.begin() + static_cast<std::ptrdiff_t>(of.size()));
      best[i] = of[static_cast<std::size_t>(least - costs.begin())].view;
    }
    return best;
  }

 private:
  // Of each view of a triangle, with what its neighbours say.
  Costs CostsOf(std::size_t triangle) const {
    const auto of = views_.Of(triangle);
    Costs costs{};
    for (std::size_t k = 0; k < of.size(); ++k) {
      costs.at(k) = 1 - std::sqrt(of[k].area_px / of[0].area_px);
      for (const Costs& message : messages_[triangle]) costs.at(k) += message.at(k);
    }
    return costs;
  }

  void Send(std::size_t from) {
    const auto of = views_.Of(from);
    if (of.empty()) return;
    const Costs costs = CostsOf(from);
    for (std::size_t edge = 0; edge < 3; ++edge) {
      const std::uint32_t to = neighbours_[from].at(edge);
      if (to == kNoTriangle) continue;
      // Without what the other one has said itself.
      Costs others = costs;
      float least = std::numeric_limits<float>::max();
      for (std::size_t k = 0; k < of.size(); ++k) {
        others.at(k) -= messages_[from].at(edge).at(k);
        least = std::min(least, others.at(k));
      }
      const auto back = std::ranges::find(neighbours_[to], static_cast<std::uint32_t>(from));
      if (back == neighbours_[to].end()) continue;
      Costs& message = messages_[to].at(static_cast<std::size_t>(back - neighbours_[to].begin()));
      const auto of_other = views_.Of(to);
      for (std::size_t k = 0; k < of_other.size(); ++k) {
        float cost = kBorderCost;
        for (std::size_t own = 0; own < of.size(); ++own) {
          if (of[own].view == of_other[k].view) cost = std::min(cost, others.at(own) - least);
        }
        message.at(k) = cost;
      }
    }
  }

  const TriangleViews& views_;
  const TriangleNeighbours& neighbours_;
  std::vector<std::array<Costs, 3>> messages_;  // to each triangle, over each of its edges
};

// Single triangles and the like, which the propagation leaves where it has not settled: each takes
// the view of least cost beside its neighbours as they are.
void SettleViews(const TriangleViews& views, const TriangleNeighbours& neighbours,
                 std::vector<std::uint32_t>& chosen) {
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const auto of = views.Of(i);
    float least = std::numeric_limits<float>::max();
    for (const TriangleView& view : of) {
      float cost = 1 - std::sqrt(view.area_px / of[0].area_px);
      for (const std::uint32_t neighbour : neighbours[i]) {
        if (neighbour != kNoTriangle && chosen[neighbour] != view.view) cost += kBorderCost;
      }
      if (cost < least) {
        least = cost;
        chosen[i] = view.view;
      }
    }
  }
}

}  // namespace

TriangleNeighbours FindNeighbours(const TriangleMesh& mesh) {
  struct EdgeSide {
    std::uint32_t triangle = kNoTriangle;
    std::uint32_t edge = 0;
    int num_sides = 0;
  };
  TriangleNeighbours neighbours(mesh.triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  std::unordered_map<std::uint64_t, EdgeSide> sides;
  sides.reserve(2 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::uint32_t edge = 0; edge < 3; ++edge) {
      const auto [a, b] =
          std::minmax({mesh.triangles[i].at(edge), mesh.triangles[i].at((edge + 1) % 3)});
      EdgeSide& other = sides[std::uint64_t{a} << 32U | b];
      ++other.num_sides;
      if (other.num_sides == 1) {
        other.triangle = static_cast<std::uint32_t>(i);
        other.edge = edge;
      } else if (other.num_sides == 2 && other.triangle != i) {
        neighbours[i].at(edge) = other.triangle;
        neighbours[other.triangle].at(other.edge) = static_cast<std::uint32_t>(i);
      } else if (other.num_sides == 3) {  // crowded: nobody's neighbour
        const std::uint32_t second = neighbours[other.triangle].at(other.edge);
        neighbours[other.triangle].at(other.edge) = kNoTriangle;
        if (second == kNoTriangle) continue;
        for (std::uint32_t& neighbour : neighbours[second]) {
          if (neighbour == other.triangle) neighbour = kNoTriangle;
        }
      }
    }
  }
  return neighbours;
}

std::vector<std::uint32_t> ChooseViews(const TriangleViews& views,
                                       const TriangleNeighbours& neighbours) {
  constexpr int kSweeps = 12;
  ViewPropagation propagation(views, neighbours);
  for (int sweep = 0; sweep < kSweeps; ++sweep) propagation.Sweep();
  std::vector<std::uint32_t> chosen = propagation.Best();
  for (int round = 0; round < 3; ++round) SettleViews(views, neighbours, chosen);
  return chosen;
}

}  // namespace mono3d
