// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d::tools {

// One surfel as a view shows it.
struct ViewSurfel {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float radius = 0;
  std::array<std::uint8_t, 3> colour = {200, 200, 200};  // red, green, blue
  float confidence = 1;
  std::uint32_t observations = 1;
  float error = 0;  // 0 to 1 of the largest one that colours tell apart; 0 where none is known
  std::optional<std::uint32_t> first_frame =
      {};  // whose depth map saw it first; nothing: not known
};

inline constexpr std::size_t kBytesOfSurfel = 16;

// Numbers of frames, the first and the last one of them.
struct FrameRange {
  std::uint32_t first = 0, last = 0;
};

// Surfels that travel to the page together.
struct SurfelBlock {
  std::int64_t id = 0;
  // kBytesOfSurfel for each, little endian: uint16 x y z from `low` (0) to `high` (65535), uint8
  // radius (255: `max_radius`, each step less: 2^(-1/20) of it), uint8 its frame from the first (0)
  // to the last one (255) of `frames`, normal as two int8 over 127 (the sphere folded to an
  // octahedron, its lower half outwards; -128: none), uint8 observations (255: or more), uint8
  // error over 255, uint8 red green blue, uint8 confidence over 255. In a random order: the first
  // ones, alone, are a coarser block.
  std::shared_ptr<const std::string> surfels = {};
  Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = Eigen::Vector3f::Zero();
  float max_radius = 0;
  Similarity S_world_block = {};
  std::optional<FrameRange> frames = {};  // that saw them first; nothing: not known
  // Bounds and frames then hold this one as well.
  void Cover(const ViewSurfel& surfel, bool is_first_of_all);
  std::int64_t num_surfels() const {
    return static_cast<std::int64_t>(surfels ? surfels->size() / kBytesOfSurfel : 0);
  }
};

// Fills what depends on the surfels; puts them into the random order. A coordinate that is not
// finite leaves its surfel out.
SurfelBlock MakeSurfelBlock(std::vector<ViewSurfel> surfels);

// Writes kBytesOfSurfel bytes; the bounds of the block are known.
void EncodeSurfel(const ViewSurfel& surfel, const SurfelBlock& block, char* to);
// Can it be shown: is it finite?
bool IsFinite(const ViewSurfel& surfel);
// Puts encoded surfels into the random order: the same each time, so that nothing flickers.
void ShuffleSurfels(std::string& bytes);

// Surfels of a cloud with normals and radii, without those of less confidence.
std::vector<ViewSurfel> ToViewSurfels(const PointCloud& cloud, double min_confidence = 0);

}  // namespace mono3d::tools
