// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_search.h"

#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>

#include <algorithm>
#include <cassert>
#include <opencv2/core/utility.hpp>

namespace mono3d {
namespace {

constexpr int kLeafSize = 10;          // points of a leaf
constexpr int kQueriesPerTask = 4096;  // of one thread at a time

void CopyCentred(const Eigen::Vector3d& point, const Eigen::Vector3d& centre, float* out) {
  const Eigen::Vector3f centred = (point - centre).cast<float>();
  std::copy_n(centred.data(), 3, out);
}

}  // namespace

struct CloudSearch::Tree {
  Eigen::Vector3d centre;  // taken off, so that floats resolve the cloud and not its place
  std::vector<float> coordinates;
  std::unique_ptr<flann::KDTreeSingleIndex<flann::L2_Simple<float>>> index;
};

CloudSearch::CloudSearch(std::span<const Eigen::Vector3d> points)
    : tree_(std::make_unique<Tree>()) {
  assert(!points.empty());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  tree_->centre = sum / static_cast<double>(points.size());
  tree_->coordinates.resize(3 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CopyCentred(points[i], tree_->centre, &tree_->coordinates[3 * i]);
  }
  const flann::Matrix<float> matrix(tree_->coordinates.data(), points.size(), 3);
  tree_->index = std::make_unique<flann::KDTreeSingleIndex<flann::L2_Simple<float>>>(
      matrix, flann::KDTreeSingleIndexParams(kLeafSize));
  tree_->index->buildIndex();
}

CloudSearch::~CloudSearch() = default;
CloudSearch::CloudSearch(CloudSearch&&) noexcept = default;
CloudSearch& CloudSearch::operator=(CloudSearch&&) noexcept = default;

std::vector<std::uint32_t> CloudSearch::Nearest(std::span<const Eigen::Vector3d> queries,
                                                int count) const {
  const auto per_query = static_cast<std::size_t>(count);
  assert(per_query <= tree_->coordinates.size() / 3);
  std::vector<std::uint32_t> nearest(queries.size() * per_query);
  const auto search = [&](std::size_t begin, std::size_t end) {
    const std::size_t size = end - begin;
    std::vector<float> coordinates(3 * size);
    std::vector<std::size_t> indices(per_query * size);
    std::vector<float> distances(per_query * size);
    for (std::size_t i = 0; i < size; ++i) {
      CopyCentred(queries[begin + i], tree_->centre, &coordinates[3 * i]);
    }
    flann::Matrix<float> query_matrix(coordinates.data(), size, 3);
    flann::Matrix<std::size_t> index_matrix(indices.data(), size, per_query);
    flann::Matrix<float> distance_matrix(distances.data(), size, per_query);
    tree_->index->knnSearch(query_matrix, index_matrix, distance_matrix, per_query,
                            flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
    std::ranges::transform(indices,
                           nearest.begin() + static_cast<std::ptrdiff_t>(begin * per_query),
                           [](std::size_t index) { return static_cast<std::uint32_t>(index); });
  };
  const auto num_tasks = static_cast<int>((queries.size() + kQueriesPerTask - 1) / kQueriesPerTask);
  cv::parallel_for_(cv::Range(0, num_tasks), [&](const cv::Range& tasks) {
    for (int task = tasks.start; task < tasks.end; ++task) {
      const std::size_t begin = static_cast<std::size_t>(task) * kQueriesPerTask;
      search(begin, std::min(begin + kQueriesPerTask, queries.size()));
    }
  });
  return nearest;
}

}  // namespace mono3d
