// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/model_blocks.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace mono3d::tools {
namespace {

constexpr std::int64_t kSurfelsOfBlock = 65536;
constexpr std::int64_t kMaxSample = 200'000;
// Vertices that are read together, of one page of the file.
constexpr std::int64_t kRun = 64;

}  // namespace

ModelBlocks::ModelBlocks(const PlyVertices& vertices, const ModelErrors* errors)
    : vertices_(vertices), errors_(errors) {
  TakeSample();
  while ((kSurfelsOfBlock << num_levels_) < vertices.size()) ++num_levels_;
  splits_.resize((std::size_t{1} << num_levels_) - 1);
  std::vector<Eigen::Vector3f> points;
  for (const ViewSurfel& surfel : sample_) points.push_back(surfel.point);
  Build(0, points);
}

ViewSurfel ModelBlocks::At(std::int64_t i) const {
  ViewSurfel surfel = vertices_.At(i);
  if (errors_ != nullptr) surfel.error = errors_->ShareAt(i);
  return surfel;
}

void ModelBlocks::TakeSample() {
  const std::int64_t num_runs = std::max<std::int64_t>(1, kMaxSample / kRun);
  const std::int64_t step = std::max<std::int64_t>(kRun, vertices_.size() / num_runs);
  for (std::int64_t begin = 0; begin < vertices_.size(); begin += step) {
    const std::int64_t end = std::min(begin + kRun, vertices_.size());
    for (std::int64_t i = begin; i < end; ++i) {
      const ViewSurfel surfel = At(i);
      if (IsFinite(surfel)) sample_.push_back(surfel);
    }
  }
}

void ModelBlocks::Build(std::size_t node, std::span<Eigen::Vector3f> points) {
  if (node >= splits_.size() || points.empty()) return;
  Eigen::Vector3f low = points.front(), high = low;
  for (const Eigen::Vector3f& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
  std::nth_element(
      points.begin(), middle, points.end(),
      [axis](const Eigen::Vector3f& a, const Eigen::Vector3f& b) { return a[axis] < b[axis]; });
  splits_[node] = {axis, (*middle)[axis]};
  Build(2 * node + 1, points.first(points.size() / 2));
  Build(2 * node + 2, points.subspan(points.size() / 2));
}

std::size_t ModelBlocks::BlockOf(const Eigen::Vector3f& point) const {
  std::size_t node = 0;
  while (node < splits_.size()) {
    const Split& split = splits_[node];
    node = 2 * node + (point[split.axis] < split.value ? 1 : 2);
  }
  return node - splits_.size();
}

std::vector<SurfelBlock> ModelBlocks::Preview() const {
  std::vector<std::vector<ViewSurfel>> surfels(splits_.size() + 1);
  for (const ViewSurfel& surfel : sample_) surfels[BlockOf(surfel.point)].push_back(surfel);
  // Fewer of them have to cover the surface as well.
  const float factor = std::sqrt(static_cast<float>(vertices_.size()) /
                                 static_cast<float>(std::max<std::size_t>(1, sample_.size())));
  std::vector<SurfelBlock> blocks;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    for (ViewSurfel& surfel : surfels[i]) surfel.radius *= factor;
    blocks.push_back(MakeSurfelBlock(std::move(surfels[i])));
    blocks.back().id = static_cast<std::int64_t>(i);
  }
  return blocks;
}

std::vector<SurfelBlock> ModelBlocks::All() const {
  const std::size_t num_blocks = splits_.size() + 1;
  constexpr auto kNone = std::numeric_limits<std::uint16_t>::max();
  std::vector<std::uint16_t> block_of(static_cast<std::size_t>(vertices_.size()), kNone);
  std::vector<SurfelBlock> blocks(num_blocks);
  std::vector<std::size_t> sizes(num_blocks, 0);
  for (std::int64_t i = 0; i < vertices_.size(); ++i) {
    const ViewSurfel surfel = vertices_.At(i);
    if (!IsFinite(surfel)) continue;
    const std::size_t index = BlockOf(surfel.point);
    block_of[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(index);
    blocks[index].Cover(surfel, sizes[index]++ == 0);
  }
  std::vector<std::string> bytes(num_blocks);
  for (std::size_t k = 0; k < num_blocks; ++k) bytes[k].resize(sizes[k] * kBytesOfSurfel);
  std::vector<std::size_t> filled(num_blocks, 0);
  for (std::int64_t i = 0; i < vertices_.size(); ++i) {
    const std::uint16_t index = block_of[static_cast<std::size_t>(i)];
    if (index == kNone) continue;
    EncodeSurfel(At(i), blocks[index], bytes[index].data() + filled[index]++ * kBytesOfSurfel);
  }
  for (std::size_t k = 0; k < num_blocks; ++k) {
    ShuffleSurfels(bytes[k]);
    blocks[k].id = static_cast<std::int64_t>(k);
    blocks[k].surfels = std::make_shared<const std::string>(std::move(bytes[k]));
  }
  return blocks;
}

std::vector<Eigen::Vector3f> ModelBlocks::Normals() const {
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(sample_.size());
  for (const ViewSurfel& surfel : sample_) normals.push_back(surfel.normal);
  return normals;
}

}  // namespace mono3d::tools
