// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/inference.h"

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "depth/buffers.h"
#include "depth/inference_tiles.h"

namespace mono3d {
namespace {

// Steps on each level. Even: they go from one buffer to the other and back. What is farther than a
// few pixels from data has been found on a coarser level. The finest level has most of the pixels,
// and four steps there come to the same (decision 42).
constexpr int kRelaxations = 8;
constexpr int kFinestRelaxations = 4;
// Of confidence, per pixel of half the resolution; neighbours of one grey value have a conductance
// of 1, so that it falls to a third over 70 of these pixels, and sooner across edges.
constexpr float kLeak = 2e-4F;
constexpr std::size_t kTexelBytes = 16;

}  // namespace

Inference::Inference(std::shared_ptr<Device> device, DepthKernels& kernels,
                     const InferenceOptions& options)
    : device_(std::move(device)), kernels_(kernels), options_(options) {}

void Inference::Prepare(LevelSize full) {
  std::size_t num_levels = 0;
  LevelSize size = full;
  do {
    size = size.Halved();
    if (levels_.size() <= num_levels) levels_.emplace_back();
    Level& level = levels_[num_levels++];
    level.size = size;
    Reserve(level.data, device_, kTexelBytes * size.num_pixels(), "depth/inference_data");
    Reserve(level.state, device_, kTexelBytes * size.num_pixels(), "depth/inference_state");
    Reserve(level.next, device_, kTexelBytes * size.num_pixels(), "depth/inference_next");
  } while (size.num_pixels() > 1);
  levels_.resize(num_levels);
  Reserve(inverse_depth_, device_, sizeof(float) * full.num_pixels(), "depth/inference");
  Reserve(confidence_, device_, sizeof(float) * full.num_pixels(), "depth/inferred_confidence");
  Reserve(normals_, device_, 3 * sizeof(float) * full.num_pixels(), "depth/inferred_normals");
}

void Inference::RecordSurface(Recorder& recorder) {
  for (std::size_t i = levels_.size(); i-- > 0;) {
    Level& level = levels_[i];
    const float leak = kLeak * std::pow(4.0F, static_cast<float>(i));
    if (i + 1 == levels_.size()) {
      // Its one pixel has no neighbours: the state before does not matter.
      kernels_.InferenceRelax(recorder, level.size, leak, level.data, level.data, level.state);
      continue;
    }
    kernels_.InferenceExpand(recorder, levels_[i + 1].size, level.size, levels_[i + 1].state,
                             level.data, level.state);
    for (int step = 0; step < (i == 0 ? kFinestRelaxations : kRelaxations); step += 2) {
      kernels_.InferenceRelax(recorder, level.size, leak, level.data, level.state, level.next);
      kernels_.InferenceRelax(recorder, level.size, leak, level.data, level.next, level.state);
    }
  }
}

void Inference::Record(Recorder& recorder, const Input& input) {
  Prepare(input.size);
  const cv::Mat cells = input.cells.isContinuous() ? input.cells : input.cells.clone();
  Reserve(cells_, device_, kTexelBytes * cells.total(), "depth/cells");
  cells_.Upload(std::span(cells.ptr<float>(), 4 * cells.total()));
  Reserve(projections_, device_, kMaxProjectionBytes, "depth/inference_projections");
  const std::vector<float> packed = Pack(input.projections, input.size);
  projections_.Upload(std::span<const float>(packed));
  const std::vector<std::uint32_t> tiles = WordsOfTiles(input.tiles);
  Reserve(tiles_, device_, sizeof(std::uint32_t) * tiles.size(), "depth/inference_tiles");
  tiles_.Upload(std::span<const std::uint32_t>(tiles));
  recorder.Fill(confidence_, 0);
  kernels_.InferenceData(recorder, input.size, input.matched, input.depth, input.halved, cells_,
                         levels_.front().data, inverse_depth_);
  for (std::size_t i = 0; i + 1 < levels_.size(); ++i) {
    kernels_.InferenceHalve(recorder, levels_[i].size, levels_[i].data, levels_[i + 1].data);
  }
  RecordSurface(recorder);
  kernels_.Inference(recorder, input.projections.size(),
                     {.width_px = input.size.width_px,
                      .height_px = input.size.height_px,
                      .winner_width_px = input.winner_size.width_px,
                      .winner_level = static_cast<std::uint32_t>(input.winner_level),
                      .inverse_depth_step = static_cast<float>(input.step),
                      .max_difference = static_cast<float>(options_.max_difference),
                      .min_views = static_cast<float>(input.min_views),
                      .min_coarse_views = static_cast<float>(input.min_coarse_views)},
                     {tiles_, input.tiles.size()}, input.depth, input.winners,
                     levels_.front().state, input.images, cells_, projections_,
                     {inverse_depth_, confidence_});
  kernels_.InferenceNormals(recorder, input.normals, {tiles_, input.tiles.size()}, inverse_depth_,
                            normals_);
}

}  // namespace mono3d
