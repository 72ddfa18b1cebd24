// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/error_file.h"

#include <array>
#include <bit>
#include <string>

#include "mono3d/core/atomic_file.h"

namespace mono3d::tools {

static_assert(std::endian::native == std::endian::little, "the file is little endian");

void WriteErrorFile(const std::filesystem::path& path, const PointCloud& model,
                    std::span<const double> distances_m) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\n"
      "comment error: distance from the true surface, in metres\nelement vertex " +
      std::to_string(model.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty float error\nend_header\n";
  text.reserve(text.size() + model.size() * sizeof(std::array<float, 4>));
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Eigen::Vector3f& p = model.points[i];
    const std::array<float, 4> vertex = {p.x(), p.y(), p.z(), static_cast<float>(distances_m[i])};
    text.append(reinterpret_cast<const char*>(vertex.data()), sizeof vertex);
  }
  WriteFileAtomically(path, text);
}

}  // namespace mono3d::tools
