// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/view_shares.h"

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cstddef>

namespace mono3d {
namespace {

// Views whose share at a vertex is smaller than the others' are left out beyond this number.
constexpr std::size_t kMostShares = 6;

float AreaOf(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm() /
         2;
}

void AddShare(std::vector<ViewShare>& shares, std::uint32_t view, float share) {
  const auto found = std::ranges::find(shares, view, &ViewShare::view);
  if (found != shares.end()) {
    found->share += share;
  } else {
    shares.push_back({.view = view, .share = share});
  }
}

void NormaliseShares(std::vector<ViewShare>& shares) {
  std::ranges::sort(shares, [](const ViewShare& a, const ViewShare& b) {
    return a.share != b.share ? a.share > b.share : a.view < b.view;
  });
  if (shares.size() > kMostShares) shares.resize(kMostShares);
  float sum = 0;
  for (const ViewShare& share : shares) sum += share.share;
  for (ViewShare& share : shares) share.share /= sum;
}

// Each vertex takes half of its shares from its neighbours.
ViewShares SpreadToNeighbours(const TriangleMesh& mesh, const ViewShares& shares) {
  std::vector<float> num_neighbours(shares.size(), 0);
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) num_neighbours[corner] += 2;
  }
  ViewShares spread = shares;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t to : triangle) {
      for (const std::uint32_t from : triangle) {
        if (from == to) continue;
        for (const ViewShare& share : shares[from]) {
          AddShare(spread[to], share.view, share.share / num_neighbours[to]);
        }
      }
    }
  }
  for (auto& of : spread) {
    if (!of.empty()) NormaliseShares(of);
  }
  return spread;
}

// The shares of all vertices in one row: an unknown each.
class SeamSystem {
 public:
  SeamSystem(const TriangleMesh& mesh, const ViewShares& shares) : shares_(shares) {
    first_.reserve(shares.size());
    for (const auto& of : shares) {
      first_.push_back(count_);
      count_ += static_cast<int>(of.size());
    }
    colours_.setZero(count_, 3);
    weights_.setZero(count_);
    AddSmoothness(mesh);
  }

  // The mean colour around a vertex as its views show it.
  void AddColour(std::uint32_t vertex, std::uint32_t view, const Eigen::Vector3f& colour,
                 float weight) {
    const int unknown = Find(vertex, view);
    if (unknown < 0) return;
    colours_.row(unknown) += weight * colour.transpose();
    weights_[unknown] += weight;
  }

  // Views at a vertex should agree: (colour a + adjustment a - colour b - adjustment b)^2.
  Eigen::MatrixX3f Solve() {
    Eigen::MatrixX3f right = Eigen::MatrixX3f::Zero(count_, 3);
    for (std::size_t vertex = 0; vertex < shares_.size(); ++vertex) {
      const int begin = first_[vertex];
      const int end = begin + static_cast<int>(shares_[vertex].size());
      for (int a = begin; a < end; ++a) {
        for (int b = a + 1; b < end; ++b) {
          if (weights_[a] == 0 || weights_[b] == 0) continue;
          const Eigen::RowVector3f difference =
              colours_.row(a) / weights_[a] - colours_.row(b) / weights_[b];
          AddDifference(a, b, 1);
          right.row(a) -= difference;
          right.row(b) += difference;
        }
      }
    }
    Eigen::SparseMatrix<float> matrix(count_, count_);
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<float>, Eigen::Lower | Eigen::Upper> solver;
    // Adjustments are some grey levels, of which images tell one.
    solver.setTolerance(1e-3F);
    solver.setMaxIterations(500);
    solver.compute(matrix);
    return solver.solve(right);
  }

  int first(std::size_t vertex) const { return first_[vertex]; }

 private:
  int Find(std::uint32_t vertex, std::uint32_t view) const {
    const auto& of = shares_[vertex];
    const auto found = std::ranges::find(of, view, &ViewShare::view);
    return found == of.end() ? -1 : first_[vertex] + static_cast<int>(found - of.begin());
  }

  void AddDifference(int a, int b, float weight) {
    entries_.emplace_back(a, a, weight);
    entries_.emplace_back(b, b, weight);
    entries_.emplace_back(a, b, -weight);
    entries_.emplace_back(b, a, -weight);
  }

  void AddSmoothness(const TriangleMesh& mesh) {
    // Steps spread over the root of it, three vertices, before they are gone; noise of single
    // vertices is evened out.
    constexpr float kSmoothness = 10;
    // Adjustments die away over some hundred vertices: a view that is dark on one side only is not
    // changed on the other.
    constexpr float kPrior = 1e-3F;
    for (int i = 0; i < count_; ++i) entries_.emplace_back(i, i, kPrior);
    for (const auto& triangle : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = triangle.at(k);
        const std::uint32_t to = triangle.at((k + 1) % 3);
        for (std::size_t i = 0; i < shares_[from].size(); ++i) {
          const int other = Find(to, shares_[from][i].view);
          // Each edge comes twice, but for borders.
          if (other >= 0) AddDifference(first_[from] + static_cast<int>(i), other, kSmoothness / 2);
        }
      }
    }
  }

  const ViewShares& shares_;
  std::vector<int> first_;  // unknown of each vertex
  int count_ = 0;
  Eigen::MatrixX3f colours_;  // sums of the colours, and of their weights
  Eigen::VectorXf weights_;
  std::vector<Eigen::Triplet<float>> entries_;
};

}  // namespace

ViewShares ShareViews(const TriangleMesh& mesh, const TriangleViews& views,
                      const std::vector<std::uint32_t>& chosen, int num_blended) {
  // Seams are as wide as the triangles within this many edges of them.
  constexpr int kRings = 2;
  ViewShares shares(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (chosen[i] == kNoView) continue;
    const float area = AreaOf(mesh, i);
    int num_views = 0;
    const auto add = [&](std::uint32_t view) {
      for (const std::uint32_t corner : mesh.triangles[i]) AddShare(shares[corner], view, area);
      ++num_views;
    };
    add(chosen[i]);
    for (const TriangleView& view : views.Of(i)) {
      if (num_views < num_blended && view.view != chosen[i]) add(view.view);
    }
  }
  for (auto& of : shares) {
    if (!of.empty()) NormaliseShares(of);
  }
  for (int ring = 0; ring < kRings; ++ring) shares = SpreadToNeighbours(mesh, shares);
  return shares;
}

void LevelSeams(const TriangleMesh& mesh, const TriangleViews& views,
                std::span<const Eigen::Vector3f> gains, ViewShares& shares) {
  SeamSystem system(mesh, shares);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const float area = AreaOf(mesh, i);
    for (const TriangleView& view : views.Of(i)) {
      const Eigen::Vector3f colour(view.colour[0], view.colour[1], view.colour[2]);
      for (const std::uint32_t corner : mesh.triangles[i]) {
        system.AddColour(corner, view.view, gains[view.view].cwiseProduct(colour), area);
      }
    }
  }
  const Eigen::MatrixX3f adjustments = system.Solve();
  for (std::size_t vertex = 0; vertex < shares.size(); ++vertex) {
    for (std::size_t i = 0; i < shares[vertex].size(); ++i) {
      shares[vertex][i].adjustment =
          adjustments.row(system.first(vertex) + static_cast<int>(i)).transpose();
    }
  }
}

}  // namespace mono3d
