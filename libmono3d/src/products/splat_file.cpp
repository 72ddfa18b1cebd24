// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/splat_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include "io/binary_block.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_reader.h"

namespace mono3d {
namespace {

static_assert(std::endian::native == std::endian::little);

// The spherical harmonic of degree 0.
const float kHarmonic0 = .5F * std::sqrt(std::numbers::inv_pi_v<float>);

// A disc of radius r has this standard deviation along each axis of its plane, in radii.
constexpr float kSpread = .5F;
constexpr float kThickness = .1F;  // of the spread: a sheet, but with a volume for optimisers

// Splats that are quite transparent or quite opaque do not move under gradients.
constexpr float kLeastOpacity = .05F;
constexpr float kMostOpacity = .99F;

constexpr std::array<const char*, 17> kProperties = {
    "x",       "y",       "z",       "nx",      "ny",    "nz",    "f_dc_0", "f_dc_1", "f_dc_2",
    "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",  "rot_3"};

// `first`: the number of the first of these surfels in the model.
void RequireSplattable(const PointCloud& surfels, std::size_t first) {
  CheckCloud(surfels, "splats");
  const auto refuse = [](const std::string& expected, const std::string& found) {
    throw Error(ErrorParts{"no splats can be made of this model", "splats", expected, found});
  };
  if (surfels.normals.empty()) refuse("normals", "none");
  if (surfels.radii.empty()) refuse("radii", "none");
  if (surfels.colours.empty()) refuse("colours", "none");
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!std::isfinite(surfels.radii[i]) || !(surfels.radii[i] > 0)) {
      refuse("positive radii",
             std::to_string(surfels.radii[i]) + " of surfel " + std::to_string(first + i));
    }
  }
}

std::array<float, kProperties.size()> SplatOf(const PointCloud& surfels, std::size_t i) {
  const Eigen::Vector3f& p = surfels.points[i];
  const Eigen::Vector3f& n = surfels.normals[i];
  // Its z axis along the normal.
  const Eigen::Quaternionf q = Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), n);
  std::array<float, 3> harmonics{};
  for (std::size_t c = 0; c < 3; ++c) {
    harmonics.at(c) = (static_cast<float>(surfels.colours[i].at(c)) / 255 - .5F) / kHarmonic0;
  }
  const float opacity = std::clamp(surfels.confidences.empty() ? 1.F : surfels.confidences[i],
                                   kLeastOpacity, kMostOpacity);
  const float spread = std::log(kSpread * surfels.radii[i]);
  return {p.x(),
          p.y(),
          p.z(),
          n.x(),
          n.y(),
          n.z(),
          harmonics[0],
          harmonics[1],
          harmonics[2],
          std::log(opacity / (1 - opacity)),
          spread,
          spread,
          spread + std::log(kThickness),
          q.w(),
          q.x(),
          q.y(),
          q.z()};
}

std::string HeaderOfSplats(std::size_t num_splats) {
  std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(num_splats) + "\n";
  for (const char* property : kProperties) {
    header += std::string("property float ") + property + "\n";
  }
  return header + "end_header\n";
}

}  // namespace

void WriteSplats(const std::filesystem::path& file, const PointCloud& surfels) {
  RequireSplattable(surfels, 0);
  std::string bytes = HeaderOfSplats(surfels.size());
  bytes.reserve(bytes.size() + surfels.size() * kProperties.size() * sizeof(float));
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    AppendBytes(bytes, SplatOf(surfels, i).data(), kProperties.size());
  }
  WriteFileAtomically(file, bytes);
}

void WriteSplatsOf(const std::filesystem::path& model, const std::filesystem::path& file) {
  constexpr std::size_t kSurfelsOfBlock = std::size_t{1} << 16;
  PlyReader reader(model);
  if (reader.size() == 0) RequireSplattable({}, 0);
  AtomicFile target(file);
  std::string bytes = HeaderOfSplats(reader.size());
  PointCloud block;
  for (std::size_t first = 0; reader.Read(kSurfelsOfBlock, block) > 0; first += block.size()) {
    RequireSplattable(block, first);
    for (std::size_t i = 0; i < block.size(); ++i) {
      AppendBytes(bytes, SplatOf(block, i).data(), kProperties.size());
      WriteWhenFull(target, bytes);
    }
  }
  target.Write(bytes);
  target.Commit();
}

}  // namespace mono3d
